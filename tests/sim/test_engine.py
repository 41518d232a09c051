"""The CPU engine: one state of many robots, resets, delays and broken worlds."""

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.robot.facts import KEY_BODIES, stand_pose
from bumblebee.robot.model import build_model, build_spec
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import add_foot_sensors, load_model

STAND = torch.tensor(stand_pose(), dtype=torch.float32)


def standing(engine: MujocoCpu, n: int) -> tuple[torch.Tensor, torch.Tensor]:
    qpos = torch.tensor(engine.model.key_qpos[0], dtype=torch.float32).repeat(n, 1)
    return qpos, torch.zeros(n, engine.model.nv)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return load_model()


def test_a_standing_robot_is_carried_by_its_feet(model: mujoco.MjModel) -> None:
    """The floor's forces sum to the weight, and the feet stay level."""
    engine = MujocoCpu(model, 2, threads=1)
    for _ in range(25):
        engine.step(STAND.repeat(2, 1))
    weight = float(model.body_mass.sum() * 9.81)
    assert engine.foot_force_w()[:, :, 2].sum(1).tolist() == pytest.approx([weight] * 2, rel=0.05)
    assert engine.foot_quat_w()[..., 0].abs().min() > 0.99
    assert engine.torque().abs().max() < 139


def test_state_agrees_with_forward_kinematics_at_the_same_instant(model: mujoco.MjModel) -> None:
    """Key bodies belong to the joint angles beside them, not to the substep before."""
    engine = MujocoCpu(model, 3, threads=1)
    generator = torch.Generator().manual_seed(0)
    for _ in range(5):
        engine.step(STAND + 0.3 * torch.randn(3, 23, generator=generator))
    state = engine.state()
    data = mujoco.MjData(model)
    for world in range(3):
        data.qpos[:] = engine.batch.qpos[world]
        data.qvel[:] = engine.batch.qvel[world]
        mujoco.mj_forward(model, data)
        expected = np.array([data.body(name).xpos for name in KEY_BODIES])
        np.testing.assert_allclose(state.key_pos_w[world].numpy(), expected, atol=1e-5)
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, model.body("pelvis").id, velocity, 1)
        np.testing.assert_allclose(state.root_ang_vel_b[world].numpy(), velocity[:3], atol=1e-4)
        np.testing.assert_allclose(state.root_lin_vel_b[world].numpy(), velocity[3:], atol=1e-4)


def test_reset_touches_only_the_given_worlds(model: mujoco.MjModel) -> None:
    """The others keep their state; the reset ones start exactly where asked."""
    engine = MujocoCpu(model, 4, threads=1)
    for _ in range(10):
        engine.step(STAND.repeat(4, 1) + 0.2)
    before = engine.batch.qpos.copy()
    qpos, qvel = standing(engine, 2)
    qpos[:, 2] += 0.5
    engine.reset(torch.tensor([1, 3]), qpos, qvel, STAND.repeat(2, 1))
    np.testing.assert_array_equal(engine.batch.qpos[[0, 2]], before[[0, 2]])
    np.testing.assert_allclose(engine.state().root_pos_w[[1, 3]], qpos[:, :3], atol=1e-6)
    assert torch.allclose(engine.state().key_pos_w[1, 0], qpos[0, :3], atol=1e-5)


def test_any_number_of_threads_gives_the_same_worlds(model: mujoco.MjModel) -> None:
    """Threads divide the worlds and change nothing in them."""
    ends = []
    for threads in (1, 2):
        engine = MujocoCpu(model, 5, threads=threads)
        generator = torch.Generator().manual_seed(1)
        for _ in range(5):
            engine.step(STAND + 0.2 * torch.randn(5, 23, generator=generator))
        ends.append(engine.batch.state.copy())
    np.testing.assert_array_equal(*ends)


def test_a_saved_world_goes_on_as_if_nothing_had_happened(model: mujoco.MjModel) -> None:
    """Saving and loading between two steps leaves the trajectory bit for bit."""
    first, second = (MujocoCpu(model, 2, threads=1) for _ in range(2))
    for _ in range(4):
        first.step(STAND.repeat(2, 1) - 0.1)
    second.load_state_dict(first.state_dict())
    for engine in (first, second):
        for _ in range(4):
            engine.step(STAND.repeat(2, 1) + 0.1)
    np.testing.assert_array_equal(first.batch.qpos, second.batch.qpos)


def test_a_delayed_motor_first_holds_the_targets_of_the_reset() -> None:
    """With 20 ms of delay the first control period depends on the reset's targets only, not on the step's."""
    spec = build_spec()
    for actuator in spec.actuators:
        actuator.delay, actuator.nsample = 0.02, 8
    add_foot_sensors(spec)
    engine = MujocoCpu(spec.compile(), 2, threads=1)
    for _ in range(7):  # leave other commands in the buffers
        engine.step(STAND.repeat(2, 1) - 0.4)
    qpos, qvel = standing(engine, 2)
    held = torch.stack([STAND, STAND + 0.3])
    engine.reset(torch.arange(2), qpos, qvel, held)
    engine.step(torch.stack([STAND + 0.5, STAND]))
    moved = engine.state().joint_pos - STAND
    assert moved[0].abs().max() < 0.05
    assert moved[1, 0] > 0.02


def test_a_broken_world_is_reported_and_can_be_reset(model: mujoco.MjModel, tmp_path, monkeypatch) -> None:
    """A world that is no longer a number is named, alone, and a reset heals it."""
    monkeypatch.chdir(tmp_path)  # MuJoCo logs the warning into the working directory
    engine = MujocoCpu(model, 3, threads=1)
    engine.batch.qvel[1, 0] = np.nan
    engine.step(STAND.repeat(3, 1))
    assert engine.unstable().tolist() == [False, True, False]
    qpos, qvel = standing(engine, 1)
    engine.reset(torch.tensor([1]), qpos, qvel, STAND[None])
    engine.step(STAND.repeat(3, 1))
    assert not engine.unstable().any()
    assert torch.isfinite(engine.state().key_pos_w).all()


def test_encoder_offsets_are_read_but_not_real(model: mujoco.MjModel) -> None:
    """The hook shifts the reading of the joint angle and leaves the body where it is."""

    class Offset:
        encoder_offset = np.full(23, 0.1)

    plain, shifted = MujocoCpu(model, 1, threads=1), MujocoCpu(model, 1, threads=1, hooks=Offset())
    assert torch.allclose(shifted.state().joint_pos - plain.state().joint_pos, torch.tensor(0.1), atol=1e-6)
    assert torch.equal(shifted.state().key_pos_w, plain.state().key_pos_w)


def test_physics_must_fit_into_the_control_period_and_feet_must_feel() -> None:
    """Both are refused with a line that names what was expected."""
    with pytest.raises(BadInput, match="multiple of the control rate"):
        MujocoCpu(load_model(physics_hz=180), 1)
    with pytest.raises(BadInput, match="contact sensors"):
        MujocoCpu(build_model(), 1)


def test_bodies_follow_fields_that_move_them(model: mujoco.MjModel) -> None:
    """A world whose shank is 5 cm longer has its foot 5 cm further down at the same angles."""
    engine = MujocoCpu(model, 2, threads=1)
    foot = model.body("left_ankle_pitch_link").id
    longer = np.repeat(model.body_pos[None], 2, axis=0)
    longer[1, foot] *= 1 + 0.05 / np.linalg.norm(model.body_pos[foot])
    engine.set_fields({"body_pos": longer})
    qpos, qvel = standing(engine, 2)
    engine.reset(torch.arange(2), qpos, qvel, STAND.repeat(2, 1))
    ankle = engine.state().key_pos_w[:, [n.startswith("left_ankle") for n in KEY_BODIES].index(True)]
    assert float((ankle[1] - ankle[0]).norm()) == pytest.approx(0.05, abs=1e-5)
