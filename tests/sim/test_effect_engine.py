"""The CPU engine with hooks: what the task sees and what acts on the robot."""

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.robot.model import build_spec
from bumblebee.sim.effects import Effect, add_to_spec, runtime_hooks, single
from bumblebee.sim.effects.cpu_engine import EffectsCpu, needs_effects
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import add_foot_sensors

KNEE, ELBOW, COLUMN = "left_knee_joint", "right_elbow_joint", 3


def engine_with(*effects: Effect, worlds: int = 2) -> EffectsCpu:
    spec = build_spec()
    add_to_spec(spec, effects)
    add_foot_sensors(spec)
    model = spec.compile()
    return EffectsCpu(model, worlds, threads=1, hooks=runtime_hooks(effects, model))


def stand(engine: MujocoCpu, steps: int = 10, move: float = 0.3) -> torch.Tensor:
    """Joint readings (steps, B, 23) of a stand whose left knee is asked to bend by `move`."""
    worlds = engine.num_worlds
    key = torch.from_numpy(mujoco.MjModel.key(build_spec().compile(), "stand").qpos.copy())
    qpos, qvel = key.expand(worlds, -1), torch.zeros(worlds, 29)
    engine.reset(torch.arange(worlds), qpos, qvel, qpos[:, 7:])
    target = qpos[:, 7:].clone()
    target[:, COLUMN] += move
    out = []
    for _ in range(steps):
        engine.step(target)
        out.append(engine.state().joint_pos)
    return torch.stack(out)


def plain() -> MujocoCpu:
    spec = build_spec()
    add_foot_sensors(spec)
    return MujocoCpu(spec.compile(), 2, threads=1)


def test_only_what_the_model_cannot_carry_needs_this_engine() -> None:
    """A native friction does not; hooks and joints that no encoder reads do."""
    for effect, needed in (
        (single("coulomb_friction", KNEE, 1.0), False),
        (single("encoder_offset", KNEE, 0.1), False),
        (single("torque_lag", KNEE, 0.01), True),
        (single("backlash", KNEE, 0.1), True),
        (single("hysteresis", KNEE, 1.0, 0.1), True),
    ):
        engine = engine_with(effect)
        assert needs_effects(engine.model, runtime_hooks([effect], engine.model)) == needed


def test_without_effects_it_is_the_plain_engine() -> None:
    assert torch.equal(stand(engine_with()), stand(plain()))


@pytest.mark.parametrize(
    "effect",
    [
        single("torque_lag", KNEE, 0.03),
        single("stribeck_friction", KNEE, 5.0, 1.0),
        single("load_dependent_friction", KNEE, 0.5),
        single("cogging", KNEE, 8.0, 0.0, 12.0),
        single("encoder_delay", KNEE, 0.02),
        single("torque_speed_limit", KNEE, 1.0),
        single("dropped_commands", "", 0.9),
        single("strength_drift", KNEE, 0.9),
        single("external_wrench", "torso_link", 60.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        single("backlash", KNEE, 0.1),
        single("series_elasticity", KNEE, 200.0),
        single("hysteresis", KNEE, 8.0, 0.05),
        single("backlash", KNEE, 0.1, 1.0),
        single("series_elasticity", KNEE, 200.0, 1.0),
        single("hysteresis", KNEE, 8.0, 0.05, 1.0),
        single("asymmetric_friction", KNEE, 12.0),
    ],
    ids=lambda e: "_".join((e.effect, *(k for k in ("encoder", "dahl") if k in e.parameters))),
)
def test_an_effect_changes_the_motion_and_keeps_the_tasks_joints(effect: Effect) -> None:
    """23 joints whatever the model has, finite, and other than without."""
    engine = engine_with(effect)
    path = stand(engine)
    assert path.shape == (10, 2, 23) and engine.torque().shape[0] == 2
    assert torch.isfinite(path).all() and not engine.unstable().any()
    assert (path - stand(plain())).abs().max() > 2e-3


def test_readings_are_off_rounded_and_tilted() -> None:
    """The encoder's offset and step in joint_pos, the sensor's tilt in root_quat_w; nothing of it in the bodies."""
    effects = (
        single("encoder_offset", KNEE, 0.05),
        single("encoder_quantisation", ELBOW, 0.01),
        single("imu_offset", "pelvis", 0.1, 0.0),
    )
    engine = engine_with(*effects)
    read = stand(engine, steps=3)[-1, 0]
    true = torch.from_numpy(np.array(engine.batch.qpos[0, 7:]))
    assert float(read[COLUMN] - true[COLUMN]) == pytest.approx(0.05, abs=1e-6)
    column = runtime_hooks(effects, engine.model).joints.index(ELBOW)
    assert float(read[column] / 0.01) == pytest.approx(round(float(read[column] / 0.01)), abs=1e-3)
    quat = engine.state().root_quat_w[0].double()
    pelvis = torch.from_numpy(np.array(engine.batch.qpos[0, 3:7]))
    assert 2 * float(torch.acos((quat @ pelvis).abs())) == pytest.approx(0.1, abs=1e-3)


def test_it_goes_on_from_where_it_was() -> None:
    """A saved and restored state gives the same steps, memory of lags included."""
    effects = (single("torque_lag", KNEE, 0.03), single("thermal_fade", KNEE, 0.5))
    first, second = engine_with(*effects), engine_with(*effects)
    stand(first, 4)
    stand(second, 2, move=-0.1)
    second.load_state_dict(first.state_dict())
    target = torch.zeros(2, 23)
    for engine in (first, second):
        engine.step(target)
    assert torch.equal(first.state().joint_pos, second.state().joint_pos)


def test_friction_that_is_set_a_world_stays_beside_a_hook() -> None:
    """A hook adds to what a world was given; it does not put the model's own value back."""
    engine = engine_with(single("stribeck_friction", KNEE, 1.0, 0.5))
    dof = int(engine.model.joint(KNEE).dofadr[0])
    loss = np.tile(engine.model.dof_frictionloss, (2, 1))
    loss[1, dof] = 4.0
    engine.set_fields({"dof_frictionloss": loss})
    stand(engine, steps=1)
    written = engine.batch.expand("dof_frictionloss")[:, dof]
    assert written[1] - written[0] == pytest.approx(4.0, abs=1.0)
    assert written[1] >= 4.0
