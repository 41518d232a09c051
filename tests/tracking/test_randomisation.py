"""The rows of the paper's table of domain randomisation: ranges, what they act on, and when."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.robot.facts import stand_pose
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.presets import PAPER_RANDOMISATION, PAPER_TASK
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.worlds.pushes import push_phase, regular_push
from bumblebee.tracking.worlds.randomisation import draw_fields, randomise_worlds
from tests.tracking.clips import waving

OFF = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)
STAND = torch.tensor(stand_pose(), dtype=torch.float32)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return task_model(EnvConfig(physics_hz=200.0, randomisation=PAPER_RANDOMISATION))


def test_the_preset_is_the_papers_table() -> None:
    """Appendix B, number by number."""
    assert (
        Randomisation(
            friction=(0.5, 1.25),
            base_com=0.1,
            mass=0.2,
            gains=0.25,
            delay=(0.020, 0.040),
            push=0.5,
            push_interval=10.0,
            push_regular=True,
        )
        == PAPER_RANDOMISATION
    )
    assert PAPER_TASK.terrain.rough == 0.5
    assert (PAPER_TASK.threshold_start, PAPER_TASK.threshold_end) == (0.8, 0.3)


def test_every_row_fills_its_range_and_no_more(model: mujoco.MjModel) -> None:
    """2,000 worlds: the extremes come within 2 % of the range's width of its ends, the mean lies in the middle."""
    fields = draw_fields(model, PAPER_RANDOMISATION, 2000, seed=0)
    torso = model.body("torso_link").id
    gain, bias = fields["actuator_gainprm"], fields["actuator_biasprm"]
    rows = {
        "friction": (fields["geom_friction"][:, 0, 0] / model.geom_friction[0, 0], 0.5, 1.25),
        "base_com": (fields["body_ipos"][:, torso] - model.body_ipos[torso], -0.1, 0.1),
        "mass": (fields["body_mass"][:, 1:] / model.body_mass[1:], 0.8, 1.2),
        "p_gain": (gain[:, :, 0] / model.actuator_gainprm[:, 0], 0.75, 1.25),
        "d_gain": (bias[:, :, 2] / model.actuator_biasprm[:, 2], 0.75, 1.25),
        "delay": (fields["actuator_delay"][:, 0], 0.020, 0.040),
    }
    for name, (values, low, high) in rows.items():
        width = high - low
        assert low - 1e-6 <= values.min() < low + 0.02 * width, name
        assert high - 0.02 * width < values.max() <= high + 1e-6, name
        assert values.mean() == pytest.approx((low + high) / 2, abs=0.02 * width), name
    assert np.array_equal(bias[:, :, 1], -gain[:, :, 0])  # a servo that is stiffer is so around its target
    assert np.ptp(fields["actuator_delay"], axis=1).max() == 0  # one delay for all commands of a world
    others = np.delete(fields["body_ipos"] - model.body_ipos, torso, axis=1)
    assert np.abs(others).max() == 0


def test_a_shifted_centre_of_mass_is_felt(model: mujoco.MjModel) -> None:
    """10 cm ahead in a torso of m kg: gravity turns the waist by m g 0.1 N m more, and derived constants follow."""
    engine = MujocoCpu(model, 2, threads=1)
    moved = np.repeat(model.body_ipos[None], 2, axis=0)
    torso = model.body("torso_link").id
    moved[1, torso, 0] += 0.1
    engine.set_fields({"body_ipos": moved})
    engine.batch.qpos[:] = model.qpos0
    engine.batch.qvel[:] = 0.0
    pitch = model.joint("waist_pitch_joint").dofadr[0]
    torque = engine.batch.bind("qfrc_bias")[:, pitch]
    engine.batch.forward()
    assert abs(torque[1] - torque[0]) == pytest.approx(model.body_mass[torso] * 9.81 * 0.1, rel=1e-3)
    weights = engine.batch.expand("body_invweight0")
    assert not np.array_equal(weights[0], weights[1])


@pytest.mark.parametrize(("delay", "late"), [(0.0, [0, 0]), (0.020, [4, 0]), (0.030, [4, 2]), (0.040, [4, 4])])
def test_a_command_arrives_after_its_delay(delay: float, late: list[int]) -> None:
    """In the 4 physics steps of each of two control periods, the first `late` ones still hold the old command."""
    spread = replace(OFF, delay=(delay, delay))
    robot = task_model(EnvConfig(physics_hz=200.0, randomisation=spread))
    engine = MujocoCpu(robot, 1, threads=1)
    randomise_worlds(engine, spread, seed=0)
    start = torch.tensor(robot.key_qpos[:1], dtype=torch.float32)
    engine.reset(torch.zeros(1, dtype=torch.long), start, torch.zeros(1, robot.nv), STAND[None])
    engine.substeps = 1  # to look at every physics step
    kp, kd = robot.actuator_gainprm[:, 0], -robot.actuator_biasprm[:, 2]
    seen = []
    for _ in range(8):
        q, v = engine.batch.qpos[0, 7:].copy(), engine.batch.qvel[0, 6:].copy()
        engine.step(STAND[None] + 0.1)
        # The servo's torque tells the target that it followed.
        target = (engine.batch.bind("actuator_force")[0] + kd * v) / kp + q
        seen.append(float(np.median(target - stand_pose())))
    old = [value < 0.05 for value in seen]
    assert [sum(old[:4]), sum(old[4:])] == late


def test_a_models_own_delay_comes_first() -> None:
    """A servo that is late by 12 ms by itself is 12 ms later than the others."""
    from bumblebee.sim.sensors import load_spec
    from bumblebee.tracking.model import add_delays

    spec = load_spec(None, 200.0)
    slow = spec.actuators[3]
    slow.delay, slow.nsample, slow.interp = 0.012, 5, 1
    add_delays(spec, PAPER_RANDOMISATION)
    late = draw_fields(spec.compile(), PAPER_RANDOMISATION, 5, seed=0)["actuator_delay"]
    np.testing.assert_allclose(late[:, 3] - late[:, 0], 0.012, atol=1e-8)


def test_delays_need_a_model_with_room_and_times_in_order() -> None:
    """One line each."""
    with pytest.raises(BadInput, match=r"randomisation\.delay.*task_model"):
        randomise_worlds(MujocoCpu(load_model(), 1, threads=1), PAPER_RANDOMISATION, seed=0)
    with pytest.raises(BadInput, match=r"smaller number first"):
        task_model(EnvConfig(randomisation=replace(OFF, delay=(0.04, 0.02))))


def test_without_options_the_model_is_the_declared_one() -> None:
    """No delays, no terrain: what the demo trains on has not changed."""
    plain, task = load_model(physics_hz=100), task_model(EnvConfig())
    assert task.nhistory == task.nhfield == 0
    for field in ("geom_type", "geom_pos", "body_mass", "actuator_gainprm", "key_qpos", "sensor_adr"):
        assert np.array_equal(getattr(plain, field), getattr(task, field)), field


def test_regular_pushes_hit_every_world_once_an_interval() -> None:
    """10 s at 50 Hz: 500 steps, each of 7 worlds pushed once, at 0.5 m/s in the plane, not all at once."""
    n, dt = 7, 0.02
    clock = push_phase(PAPER_RANDOMISATION, n, dt, torch.device("cpu"))
    generator = torch.Generator().manual_seed(0)
    pushes = []
    for _ in range(500):
        clock += 1
        pushes.append(regular_push(PAPER_RANDOMISATION, clock, dt, generator))
    speed = torch.stack(pushes).norm(dim=-1)
    assert torch.equal((speed > 0).sum(0), torch.ones(n, dtype=torch.long))
    torch.testing.assert_close(speed.amax(0), torch.full((n,), 0.5))
    assert (speed > 0).sum(1).max() == 1
    assert torch.stack(pushes)[..., 2].abs().max() == 0


def test_the_environment_pushes_when_it_is_time() -> None:
    """An interval of 5 steps: in 10 steps every root is pushed twice."""
    spread = replace(OFF, push=0.5, push_interval=0.1, push_regular=True)
    config = EnvConfig(num_worlds=4, threads=1, randomisation=spread)
    engine = MujocoCpu(task_model(config), 4, threads=1)
    env = TrackingEnv(MotionLibrary([waving("a", 100)], config.ahead), engine, config, 0)
    hits = torch.zeros(4)
    push = engine.push

    def counted(velocity: torch.Tensor) -> None:
        hits.add_((velocity.norm(dim=-1) > 0).float())
        push(velocity)

    engine.push = counted  # type: ignore[method-assign]
    for _ in range(10):
        env.step(torch.zeros(4, 23))
    assert hits.tolist() == [2.0] * 4
