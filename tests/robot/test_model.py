"""The built model is the G1: mass, names, servo law, feet on the floor; and it survives a round trip through MJCF."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee.robot.facts import joint_names, joints, robot_bodies
from bumblebee.robot.model import RobotConfig, build_model, gains, write_xml


@pytest.mark.parametrize(("dof", "nq"), [(23, 30), (29, 36)])
def test_sizes_and_order(dof: int, nq: int) -> None:
    model = build_model(RobotConfig(every_joint=dof == 29))
    assert (model.nq, model.nv, model.nu) == (nq, nq - 1, dof)
    assert tuple(model.joint(i + 1).name for i in range(dof)) == joint_names(every=dof == 29)
    assert tuple(model.actuator(i).name for i in range(dof)) == joint_names(every=dof == 29)


def test_mass_is_the_tables() -> None:
    """Collision primitives add nothing to the declared inertias."""
    assert build_model().body_mass.sum() == pytest.approx(sum(b["mass"] for b in robot_bodies().values()))


def test_servo_law() -> None:
    """Torque = kp (target - q) - kd qd, clipped to the motor's limit."""
    model = build_model()
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    q, qd, target = rng.normal(0, 0.1, 23), rng.normal(0, 1, 23), rng.normal(0, 3, 23)
    data.qpos[7:], data.qvel[6:], data.ctrl[:] = q, qd, target
    mujoco.mj_forward(model, data)
    kp, kd = np.array([gains(j) for j in joints()]).T
    limit = np.array([j.effort_limit for j in joints()])
    np.testing.assert_allclose(data.actuator_force, np.clip(kp * (target - q) - kd * qd, -limit, limit), rtol=1e-9)


@pytest.mark.parametrize("feet", ["spheres", "capsules"])
def test_the_stand_touches_the_floor_with_both_feet(feet: str) -> None:
    model = build_model(RobotConfig(feet=feet))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qpos[2] -= 1e-4
    mujoco.mj_forward(model, data)
    touching = {model.geom(g).name.split("_")[0] for c in data.contact for g in c.geom if model.geom(g).name != "floor"}
    assert touching == {"left", "right"}
    assert min(c.dist for c in data.contact) > -2e-3


def test_links_collide_only_on_request() -> None:
    """With the arms pressed into the torso, the default model reports no contact between links."""
    pose = {"left_shoulder_roll_joint": -1.0, "left_elbow_joint": 1.5}

    def contacts(self_collision: bool) -> int:
        model = build_model(RobotConfig(self_collision=self_collision))
        data = mujoco.MjData(model)
        data.qpos[:] = model.key_qpos[0]
        data.qpos[2] += 1.0
        for name, angle in pose.items():
            data.joint(name).qpos[0] = angle
        mujoco.mj_forward(model, data)
        return data.ncon

    assert contacts(False) == 0
    assert contacts(True) > 0


def test_mjcf_round_trip_steps_alike(tmp_path: Path) -> None:
    write_xml(tmp_path / "g1.xml")
    written, built = mujoco.MjModel.from_xml_path(str(tmp_path / "g1.xml")), build_model()
    states = []
    for model in (written, built):
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.qpos[2] -= 1e-3  # well into contact: the keyframe itself stands on its very edge
        mujoco.mj_step(model, data, 10)
        states.append(data.qpos.copy())
    np.testing.assert_allclose(*states, atol=2e-4)  # MJCF is written with six digits
