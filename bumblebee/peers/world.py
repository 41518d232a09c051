"""The G1 that a peer's policy is tried on: its own simulation's facts or ours, its own gains or ours."""

from typing import Literal

import mujoco

from bumblebee.peers.contract import PeerContract
from bumblebee.robot.facts import joints
from bumblebee.robot.model import RobotConfig, build_spec
from bumblebee.sim.sensors import FLOOR, add_foot_sensors

PHYSICS_HZ = 200.0  # of the declared model: what our policies are tried with
Whose = Literal["own", "declared"]


def peer_model(contract: PeerContract, model: Whose, servos: Whose) -> mujoco.MjModel:
    """The G1 with foot sensors.

    Args:
        contract: the peer's facts.
        model: "own": its joints, physics rate, rotor inertias and floor friction; "declared": ours, 200 Hz.
            Bodies, masses and contacts are the G1's of `bumblebee robot` in both.
        servos: "own": its stiffness, damping and torque limits, within the motors'; "declared": ours.
    """
    own = model == "own"
    spec = build_spec(
        RobotConfig(
            every_joint=own and contract.every_joint, timestep=1.0 / (contract.physics_hz if own else PHYSICS_HZ)
        )
    )
    add_foot_sensors(spec)
    if own:
        spec.geom(FLOOR).friction = [contract.floor_friction, *spec.geom(FLOOR).friction[1:]]
        spec.geom(FLOOR).priority = 1
    column = {name: i for i, name in enumerate(contract.joints)}
    for joint in joints(own and contract.every_joint):
        i, servo = column.get(joint.name), spec.actuator(joint.name)
        if i is None:
            continue
        if own and contract.armature:
            spec.joint(joint.name).armature = contract.armature[i]
        if servos == "own":
            kp, kd, limit = contract.kp[i], contract.kd[i], joint.effort_limit
            servo.set_to_position(kp=kp, kv=kd)
            limit = min(limit, contract.effort_limit[i]) if contract.effort_limit else limit
            servo.forcerange = [-limit, limit]
    return spec.compile()
