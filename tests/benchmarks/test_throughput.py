"""The throughput benchmark: copies of motions are what they are copies of, and its rows are rates."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from benchmarks.throughput.__main__ import print_rows
from benchmarks.throughput.alone import Rolled, command, listening, physics_step, without_overflow
from benchmarks.throughput.growth import FRAMES, copies
from benchmarks.throughput.measure import environment_rate, loop_rate, make_env, physics_and_environment, started
from benchmarks.throughput.peer import write_motion
from bumblebee.errors import BadInput
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ranks import Ranks
from bumblebee.sim.effects import single
from bumblebee.sim.warp_limits import Buffers
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.tracking.clips import waving

CLIPS = [waving("a", 60), waving("b", 90)]
ROWS = ("physics", "environment", "loop, eager", "loop, captured")
QUIET = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)
GPU = pytest.param(
    "cuda", marks=[pytest.mark.gpu, pytest.mark.skipif(not torch.cuda.is_available(), reason="no NVIDIA GPU")]
)


def test_copies_are_found_where_their_motions_are() -> None:
    """Every lookup gives what the motion itself gives, its last frame at rest where it is shorter than the copy."""
    one = MotionLibrary(CLIPS, (0.1,), feed_forward=False)
    many = copies(CLIPS, 7, (0.1,), torch.device("cpu"))
    assert many.length.tolist() == [FRAMES] * 7 and len(many._rows) == 7 * FRAMES
    ids, time = torch.tensor([0, 3, 6, 5]), torch.tensor([0.5, 1.21, 7.9, 2.0])
    ours, own = many.frames(ids, time), one.frames(ids % 2, time)
    for name in ("root_pos_w", "root_quat_w", "joint_pos", "joint_vel", "key_pos_w", "ahead_joint_pos"):
        torch.testing.assert_close(getattr(ours, name), getattr(own, name))


def test_the_rows_are_rates() -> None:
    """Rates of the physics, which is the fastest, of the environment and of the loop; also with a hook a step."""
    config = EnvConfig(num_worlds=4, threads=1, physics_hz=100.0)
    ppo = PpoConfig(steps=2, epochs=1, mini_batches=1, hidden=(8,))
    for effects in ((), (single("torque_lag", "left_knee_joint", 0.01),)):
        env = make_env(config, lambda device: MotionLibrary(CLIPS, config.ahead, device=device), effects=effects)
        rates = physics_and_environment(env, 0.05)
        loop = loop_rate(started(env, ppo), 0.05)
        assert min(rates.physics, rates.held, rates.rollout) > rates.environment > 0
        assert environment_rate(env, 0.05) > 0
        assert 0 < loop.update < loop.iteration
        np.testing.assert_allclose(loop.frames * loop.iteration, 2 * 4, rtol=1e-6)


def test_both_updates_stand_beside_physics(capsys: pytest.CaptureFixture[str]) -> None:
    """A row each with its share of physics, and how long an iteration and its update take."""
    config = EnvConfig(num_worlds=4, threads=1, physics_hz=100.0)
    ppo = PpoConfig(steps=2, epochs=1, mini_batches=1, hidden=(8,))
    print_rows(config, CLIPS, {"eager": ppo, "captured": replace(ppo, captured=True)}, 0.05, [])
    lines = capsys.readouterr().out.splitlines()
    rates = {name: float(line.split(name)[1].split()[0]) for name in ROWS for line in lines if f"Hz   {name}" in line}
    shares = {name: float(line.split(name)[1].split()[1]) for name in ROWS for line in lines if f"Hz   {name}" in line}
    assert set(rates) == set(ROWS) and all(rate > 0 for rate in rates.values())
    for name in ROWS:
        assert shares[name] == pytest.approx(rates[name] / rates["physics"], abs=0.01)
    assert sum("an iteration of 2 steps" in line for line in lines) == 2


def test_physics_alone_goes_where_the_environment_went() -> None:
    """Where nobody is restarted: the engine by its own step, and `mujoco.rollout`, with the commands of the steps."""
    config = EnvConfig(num_worlds=3, threads=1, physics_hz=100.0, randomisation=QUIET, threshold_start=9.0)
    env = make_env(config, lambda device: MotionLibrary(CLIPS, config.ahead, device=device))
    began, rolled, alone = env.engine.state_dict(), Rolled(env, 4), physics_step(env)
    with listening(env.engine) as commands:
        for action in torch.linspace(0, 0.3, 4):
            assert not env.step(torch.full((3, 23), float(action)))[2].any()
    ended = env.engine.batch.qpos.copy()
    env.engine.load_state_dict(began)
    rolled.prepare(commands)
    for targets in commands:
        command(env, targets)
        alone()
    rolled()
    np.testing.assert_allclose(env.engine.batch.qpos, ended, atol=1e-9)
    np.testing.assert_allclose(rolled.last(), ended, atol=1e-9)
    assert len(commands) == 4 and env.engine.step.__name__ == "step"


@pytest.mark.parametrize("device", ["cpu", GPU])
def test_warp_alone_goes_where_the_environment_went(device: str) -> None:
    """By its own step with the commands of the steps; and all rows of a GPU's table are rates."""
    pytest.importorskip("mujoco_warp", reason="the extra `gpu` is not installed")
    config = EnvConfig("mujoco_warp", num_worlds=3, physics_hz=100.0, randomisation=QUIET, threshold_start=9.0)
    env = make_env(config, lambda where: MotionLibrary(CLIPS, config.ahead, device=where), Ranks(device=device))
    with torch.inference_mode():
        for action in torch.zeros(4, 3, 23, device=device):  # on a GPU the first steps are recorded
            env.step(action)
        began, alone = env.engine.state_dict(), physics_step(env)
        with listening(env.engine) as commands:
            for action in torch.linspace(0, 0.3, 4):
                assert not env.step(torch.full((3, 23), float(action), device=device))[2].any()
        ended = env.engine.state_dict()
        env.engine.load_state_dict(began)
        for targets in commands:
            command(env, targets)
            alone()
        torch.testing.assert_close(env.engine.state_dict()["qpos"], ended["qpos"], atol=1e-5, rtol=0)
        assert (ended["qpos"] - began["qpos"]).abs().max() > 1e-3
    rates = physics_and_environment(env, 0.05)
    assert min(rates.physics, rates.held, rates.environment) > 0 and math.isnan(rates.rollout)
    for captured in (False, True):  # a rollout's recordings are made before, in inference mode
        trainer = started(env, PpoConfig(steps=2, epochs=2, mini_batches=1, hidden=(8,), captured=captured))
        assert loop_rate(trainer, 0.05).frames > 0
        update = trainer.algorithm._device_update
        assert (update is not None) == captured
        assert update is None or (update._step._graph is not None) == (device == "cuda")


def test_physics_alone_is_not_blamed_for_contacts_that_it_drops() -> None:
    """The environment's own are still told; robots that nobody restarts may need more room."""
    pytest.importorskip("mujoco_warp", reason="the extra `gpu` is not installed")
    config = EnvConfig("mujoco_warp", num_worlds=3, physics_hz=100.0, buffers=Buffers(constraints=8))
    env = make_env(config, lambda where: MotionLibrary(CLIPS, config.ahead, device=where), Ranks(device="cpu"))
    with without_overflow(env):
        for _ in range(3):
            env.engine.step(torch.zeros(3, 23))
        with pytest.raises(BadInput, match="constraints"):
            env.engine.check()
    env.engine.check()
    env.engine.step(torch.zeros(3, 23))
    with without_overflow(env):
        pass
    with pytest.raises(BadInput, match="constraints"):
        env.engine.check()


def test_the_motion_for_mjlab_is_the_longest(tmp_path: Path) -> None:
    """With the names of its joints, since mjlab's robot has other ones too."""
    assert write_motion(tmp_path / "m.npz", CLIPS).name == "b"
    given = np.load(tmp_path / "m.npz")
    assert given["joint_pos"].shape == (90, 23) == (len(given["root_quat"]), len(given["joint_names"]))
