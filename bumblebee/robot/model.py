"""Builds the robot's MuJoCo model from its table of facts, through MjSpec.

Low-level control is a position servo on each joint, torque = kp (target - q) - kd qd, clipped to the
motor's limit (paper, appendix A: PD controller on 23 of the G1's 29 DoF).
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import mujoco
import numpy as np

from bumblebee.robot.facts import (
    FEET,
    HELD_JOINTS,
    ROBOT,
    SOLE_RADIUS,
    SOLES,
    Joint,
    joint_names,
    joints,
    made_joint,
    robot_bodies,
    stand_pose,
)
from bumblebee.robot.written import SIDES

NATURAL_FREQUENCY = 2 * np.pi * 10  # rad/s: of the servo and its rotor alone
DAMPING_RATIO = 2.0


@dataclass(frozen=True)
class RobotConfig:
    """Which model of the robot is built."""

    feet: Literal["spheres", "capsules"] = "spheres"
    """Sole contact: four corner spheres (twice as fast) or the capsules of the full model."""
    timestep: float = 0.005
    """Physics step [s]."""
    every_joint: bool = False
    """Joints that the robot's file holds still, such as the G1's wrists, move and are driven, too."""
    self_collision: bool = False
    """Contacts between the robot's own links; off, only the floor is touched."""
    frictionloss: float = 0.0
    """Declared dry friction of every joint [N m]."""
    solver_iterations: int = 5
    """Newton iterations a step; 5 with 6 line-search steps hold contact, 1 with 4 lets the feet sink."""


def gains(joint: Joint) -> tuple[float, float]:
    """Servo gains (kp [N m/rad], kd [N m s/rad]): the robot's own, or by the rotor inertia: 10 Hz, damping ratio 2."""
    if joint.kp is not None and joint.kd is not None:
        return joint.kp, joint.kd
    return joint.armature * NATURAL_FREQUENCY**2, 2 * DAMPING_RATIO * joint.armature * NATURAL_FREQUENCY


def build_spec(config: RobotConfig | None = None) -> mujoco.MjSpec:
    """The robot on a floor, as an editable spec; names are its maker's, an actuator has its joint's."""
    config = config or RobotConfig()
    spec = mujoco.MjSpec()
    spec.modelname = f"{ROBOT}_every_joint" if config.every_joint else ROBOT
    spec.compiler.degree = False
    spec.option.timestep = config.timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.iterations = config.solver_iterations
    spec.option.ls_iterations = config.solver_iterations + 1
    _add_world(spec)
    for name, facts in robot_bodies().items():
        parent = spec.worldbody if facts["parent"] == "world" else spec.body(facts["parent"])
        _add_body(parent, name, facts, config)
    for joint in joints(config.every_joint):
        _add_servo(spec, joint)
    _add_stand_keyframe(spec, config)
    return spec


def build_model(config: RobotConfig | None = None) -> mujoco.MjModel:
    """`build_spec`, compiled."""
    return build_spec(config).compile()


def write_xml(path: Path, config: RobotConfig | None = None) -> None:
    """Write the declared model as MJCF that loads in plain MuJoCo."""
    spec = build_spec(config)
    spec.compile()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(spec.to_xml())


def _add_world(spec: mujoco.MjSpec) -> None:
    spec.worldbody.add_light(pos=[0, 0, 4], dir=[0, 0, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.05],
        rgba=[0.85, 0.87, 0.9, 1],
        contype=1,
        conaffinity=2,
        friction=[1.0, 0.005, 0.0001],
    )


def _add_body(parent: Any, name: str, facts: dict[str, Any], config: RobotConfig) -> None:
    body = parent.add_body(
        name=name,
        pos=facts["pos"],
        quat=facts["quat"],
        mass=facts["mass"],
        ipos=facts["com"],
        inertia=facts["inertia"],
        iquat=facts["inertia_quat"],
        explicitinertial=True,
    )
    if facts["parent"] == "world":
        body.add_freejoint(name="floating_base")
    elif "joint" in facts and (config.every_joint or facts["joint"]["name"] not in HELD_JOINTS):
        joint = made_joint(facts["joint"])
        body.add_joint(
            name=joint.name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=joint.axis,
            range=joint.range,
            armature=joint.armature,
            frictionloss=joint.frictionloss + config.frictionloss,
            damping=[joint.damping, 0.0, 0.0],
        )
    for site in facts.get("sites", []):
        body.add_site(name=site["name"], pos=site["pos"])
    spheres = name in FEET and config.feet == "spheres"
    geoms = _sphere_sole(name) if spheres else facts.get("collision", [])
    for geom in geoms:
        _add_geom(body, geom, config)


def _sphere_sole(foot: str) -> list[dict[str, Any]]:
    side = FEET.index(foot)
    return [
        {
            "name": f"{SIDES[side]}_foot{i}_collision",
            "type": "sphere",
            "size": [SOLE_RADIUS],
            "pos": pos,
            "quat": [1, 0, 0, 0],
        }
        for i, pos in enumerate(SOLES[side], 1)
    ]


def _add_geom(body: Any, geom: dict[str, Any], config: RobotConfig) -> None:
    kind = mujoco.mjtGeom.mjGEOM_SPHERE if geom["type"] == "sphere" else mujoco.mjtGeom.mjGEOM_CAPSULE
    foot = "_foot" in geom["name"]
    body.add_geom(
        name=geom["name"],
        type=kind,
        size=[*geom["size"], *[0.0] * (3 - len(geom["size"]))],
        pos=geom["pos"],
        quat=geom["quat"],
        contype=2,
        conaffinity=3 if config.self_collision else 1,
        condim=3,
        friction=[1.0 if foot else 0.6, 0.005, 0.0001],
        rgba=[0.25, 0.28, 0.33, 1] if foot else [0.95, 0.76, 0.2, 1],
        mass=0,
    )


def _add_servo(spec: mujoco.MjSpec, joint: Joint) -> None:
    kp, kd = gains(joint)
    servo = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_position(kp=kp, kv=kd)
    servo.forcelimited = True
    servo.forcerange = [-joint.effort_limit, joint.effort_limit]


def _add_stand_keyframe(spec: mujoco.MjSpec, config: RobotConfig) -> None:
    model = spec.compile()
    data = mujoco.MjData(model)
    pose = stand_pose(config.every_joint)
    data.qpos[7:] = pose
    mujoco.mj_kinematics(model, data)
    soles = [g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name in FEET]
    data.qpos[2] -= min(data.geom_xpos[soles, 2]) - SOLE_RADIUS
    spec.add_key(name="stand", qpos=data.qpos.copy(), ctrl=pose)
    assert model.nu == len(joint_names(config.every_joint))
