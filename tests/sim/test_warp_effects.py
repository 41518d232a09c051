"""The GPU engine's hooks against the CPU engine's; on Warp's CPU device where there is no GPU."""

import mujoco
import pytest
import torch

pytest.importorskip("mujoco_warp", reason="the extra `gpu` is not installed")

from bumblebee.robot.model import build_spec
from bumblebee.sim.effects import Effect, add_to_spec, runtime_hooks, single
from bumblebee.sim.effects.cpu_engine import EffectsCpu
from bumblebee.sim.effects.warp_engine import EffectsWarp
from bumblebee.sim.mujoco_warp import MujocoWarp
from bumblebee.sim.sensors import add_foot_sensors
from bumblebee.tracking.config import Randomisation
from bumblebee.tracking.worlds.randomisation import randomise_worlds
from tests.sim.test_mujoco_warp import GPU, STAND, STEPS, WORLDS, compare, converged, started, targets

TORQUES = (
    single("stribeck_friction", "left_knee_joint", 2.0, 0.5),
    single("load_dependent_friction", "right_knee_joint", 0.1),
    single("torque_speed_limit", "left_elbow_joint", 3.0),
    single("thermal_fade", "left_hip_pitch_joint", 0.5),
    single("strength_drift", "right_hip_pitch_joint", 0.4),
    single("torque_lag", "right_elbow_joint", 0.02),
    single("command_delay", "right_elbow_joint", 0.013),  # its lag, and a filter, behind a late command
    single("command_delay", "left_ankle_pitch_joint", 0.02),
    single("command_filter", "left_ankle_pitch_joint", 0.03),
    single("command_rate_limit", "right_ankle_pitch_joint", 1.0),
    single("command_profile", "left_ankle_roll_joint", 30.0, 2.0),
    single("cogging", "waist_yaw_joint", 3.0, 1.0, 12.0),
    Effect("discovered", ("left_shoulder_roll_joint",), {"v * abs(v)": -0.4, "curve(q, -1, 2, 0, 0, 1, -1)": 0.5}),
    Effect("discovered", ("right_shoulder_roll_joint",), {"friction(1 + tanh(tau))": 0.3}),
    Effect(
        "discovered", ("right_shoulder_pitch_joint",), {"friction(rested(0.1, 0.05))": 0.5, "slewed(2, 0.02) - q": 1.0}
    ),
    Effect("discovered", ("left_shoulder_pitch_joint",), {"bound(u - q, 0.05)": 4.0, "curve(t, 0, 0, 0.1, 1)": -1.0}),
    Effect("discovered", ("left_shoulder_yaw_joint",), {"slewed(1.5, 0.02) - u": 10.0, "bound(u - q, 0.05)": -4.0}),
    Effect("discovered", ("right_shoulder_yaw_joint",), {"friction(rested(0.3, 0.02))": 0.4}),
    single("external_wrench", "torso_link", 8.0, 0.0, 0.0, 0.0, 0.0, 0.5),
)
READINGS = (
    single("encoder_delay", "left_elbow_joint", 0.007),
    single("encoder_quantisation", "right_elbow_joint", 1e-3),
    single("encoder_offset", "waist_yaw_joint", 0.05),
    single("imu_offset", "pelvis", 0.05, -0.02),
)
SHAFTS = (
    single("backlash", "left_elbow_joint", 0.05),
    single("series_elasticity", "right_elbow_joint", 200.0),
    single("hysteresis", "waist_yaw_joint", 4.0, 0.05),
)
READ_BEHIND = (
    single("backlash", "left_elbow_joint", 0.05, 1.0),
    single("series_elasticity", "right_elbow_joint", 200.0, 1.0),
    single("hysteresis", "waist_yaw_joint", 4.0, 0.05, 1.0),
)


@pytest.fixture(scope="module", params=["cpu", GPU])
def device(request: pytest.FixtureRequest) -> str:
    return request.param


def both(effects: tuple[Effect, ...], device: str) -> tuple[EffectsCpu, EffectsWarp]:
    spec = build_spec()
    add_to_spec(spec, effects)
    add_foot_sensors(spec)
    robot = converged(spec.compile())
    hooks = runtime_hooks(effects, robot)
    return EffectsCpu(robot, WORLDS, threads=1, hooks=hooks), EffectsWarp(robot, WORLDS, hooks=hooks, device=device)


@pytest.mark.parametrize("effects", [TORQUES, READINGS], ids=["torques", "readings"])
def test_hooks_act_alike_on_both_engines(effects: tuple[Effect, ...], device: str) -> None:
    """20 control steps of 4 physics steps within the tolerances of the engines themselves, worlds that differ too."""
    plain, warp = both(effects, device)
    for engine in (plain, warp):
        randomise_worlds(engine, Randomisation(gains=0.1, mass=0.1, frictionloss=0.3), seed=1)
    compare(plain, warp, device)
    a, b = plain.state(), warp.state()
    torch.testing.assert_close(a.root_quat_w, b.root_quat_w.cpu(), atol=2e-3, rtol=0)
    if a.read_key_pos_w is not None:
        assert b.read_key_pos_w is not None
        torch.testing.assert_close(a.read_key_pos_w, b.read_key_pos_w.cpu(), atol=4e-3, rtol=0)


@pytest.mark.parametrize("effects", [SHAFTS, READ_BEHIND], ids=["encoder on the motor", "encoder on the joint"])
def test_play_and_shafts_are_alike_on_both_engines(effects: tuple[Effect, ...], device: str) -> None:
    """Joints that no encoder reads, and a spring that yields or Dahl's law; the task sees 23 joints."""
    plain, warp = both(effects, device)
    assert warp.model.nq > 30
    qpos = torch.tensor(plain.model.key_qpos[0], dtype=torch.float32)[plain._q].repeat(WORLDS, 1)
    for engine in (plain, warp):
        rows = torch.ones(WORLDS, dtype=torch.bool, device=engine.device)
        where = engine.device
        engine.reset(rows, qpos.to(where), torch.zeros(WORLDS, 29, device=where), STAND.repeat(WORLDS, 1).to(where))
        engine.settle()
    for step in range(STEPS):
        plain.step(targets(step))
        warp.step(targets(step, device))
    a, b = plain.state(), warp.state()
    assert b.joint_pos.shape == (WORLDS, 23)
    torch.testing.assert_close(a.joint_pos, b.joint_pos.cpu(), atol=5e-3, rtol=0)
    torch.testing.assert_close(a.key_pos_w, b.key_pos_w.cpu(), atol=4e-3, rtol=0)


def test_a_restart_forgets_what_hooks_remember(device: str) -> None:
    """In the chosen world alone; the others go on, and a saved world goes on as if nothing had happened."""
    _, warp = both(TORQUES, device)
    started(warp)
    for step in range(3):
        warp.step(targets(step, device))
    saved = warp.state_dict()
    rows = torch.tensor([False, True, False, False], device=warp.device)
    qpos = torch.tensor(warp.model.key_qpos[0], dtype=torch.float32, device=warp.device).repeat(WORLDS, 1)
    warp.reset(rows, qpos, torch.zeros(WORLDS, 29, device=warp.device), STAND.repeat(WORLDS, 1).to(warp.device))
    time, heat = warp.state_dict()["hook_time"], warp.state_dict()["hook_heat"]
    assert time[1] == 0 and (heat[1] == 0).all()
    torch.testing.assert_close(time[[0, 2, 3]], torch.full((3,), 0.06, dtype=torch.float64))
    assert torch.equal(heat[[0, 2, 3]], saved["hook_heat"][[0, 2, 3]])
    after = []
    for _ in range(2):
        warp.load_state_dict(saved)
        warp.step(targets(3, device))
        after.append(warp.state().joint_pos)
    torch.testing.assert_close(after[0], after[1], atol=1e-5, rtol=0)


def test_lost_commands_are_held(device: str) -> None:
    """With a share of a half, about as many steps keep the command of the step before, in all joints at once."""
    _, warp = both((single("dropped_commands", "", 0.5),), device)
    started(warp)
    kept = 0
    for step in range(6):
        before = warp._ctrl.clone()
        warp.step(targets(step, device))
        same = (warp._ctrl == before).all(1)
        assert bool((same | (warp._ctrl == targets(step, device)).all(1)).all())
        kept += int(same.sum())
    assert 4 <= kept <= 20  # of 24


def test_without_hooks_it_is_the_plain_engine(device: str) -> None:
    """Numbers are equal, but for a GPU's order of sums, on a model that needs none of this."""
    spec = build_spec()
    add_foot_sensors(spec)
    robot = converged(spec.compile())
    hooks = runtime_hooks((), robot)
    engines = MujocoWarp(robot, WORLDS, device=device), EffectsWarp(robot, WORLDS, hooks=hooks, device=device)
    for engine in engines:
        started(engine)
        for step in range(3):
            engine.step(targets(step, device))
    assert isinstance(robot, mujoco.MjModel)
    torch.testing.assert_close(engines[0].state().joint_pos, engines[1].state().joint_pos, atol=1e-4, rtol=0)
