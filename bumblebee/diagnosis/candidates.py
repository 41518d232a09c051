"""The candidates: every effect of the catalogue on every place it can sit on, and the size of a first step."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.diagnosis.plant import Plant
from bumblebee.diagnosis.variation import declared_value
from bumblebee.diagnosis.windows import command_inputs
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import CATALOGUE, Effect, single

# `kp` and `kd` are not searched: they are reported as what `motor_strength` and `viscous_friction` may also be.
SEARCHED = (
    "coulomb_friction",
    "viscous_friction",
    "armature",
    "motor_strength",
    "command_delay",
    "encoder_offset",
    "link_mass",
)


@dataclass(frozen=True)
class Candidate:
    """One effect on one place."""

    effect: str
    where: str
    nominal: float
    """Its parameter in the declared model."""
    step: float
    """A change that matters, in the parameter's unit; negative where the effect makes it smaller."""

    def at(self, value: float) -> Effect:
        """The effect with its parameter at `value`, brought within its bounds."""
        kind = CATALOGUE[self.effect]
        return single(self.effect, self.where, float(np.clip(value, kind.lower, kind.upper)))

    def clip(self, value: float) -> float:
        """`value` within physical bounds."""
        kind = CATALOGUE[self.effect]
        return float(np.clip(value, kind.lower, kind.upper))


def still_joints(plant: Plant, rollouts: Sequence[Rollout], sigma: np.ndarray) -> list[str]:
    """Joints that move no more than their sensors' noise: nothing can be said of them."""
    count = len(plant.joints)
    span = np.max([np.std(r.joint_pos, axis=0) for r in rollouts], axis=0)
    speed = np.max([np.std(r.joint_vel, axis=0) for r in rollouts], axis=0)
    still = (span < 2.5 * sigma[:count]) & (speed < 1.5 * sigma[count : 2 * count])
    return [name for name, s in zip(plant.joints, still, strict=True) if s]


def all_candidates(plant: Plant, rollouts: Sequence[Rollout], still: Sequence[str]) -> list[Candidate]:
    """Every candidate on joints that move and on bodies that they carry."""
    torque, speed = _typical_torque(plant, rollouts), _typical_speed(rollouts)
    inertia = _inertia(plant)
    found = []
    for j, name in enumerate(plant.joints):
        if name in still:
            continue
        steps = {
            "coulomb_friction": 0.1 * torque[j],
            "viscous_friction": 0.1 * torque[j] / speed[j],
            "armature": 0.1 * inertia[j],
            "motor_strength": -0.1,
            "command_delay": 0.005,
            "encoder_offset": 0.01,
        }
        for kind, step in steps.items():
            if plant.actuator[j] < 0 and kind in ("motor_strength", "command_delay"):
                continue
            found.append(Candidate(kind, name, declared_value(plant, kind, name), step))
    total = plant.model.body_mass.sum()
    for body in _carried(plant, still):
        mass = declared_value(plant, "link_mass", body)
        found.append(Candidate("link_mass", body, mass, max(0.2 * mass, 0.01 * total)))
    return found


def _carried(plant: Plant, still: Sequence[str]) -> list[str]:
    """Bodies that a floating base or a joint that moves carries."""
    model = plant.model
    moving = {int(model.jnt_bodyid[model.joint(n).id]) for n in plant.joints if n not in still}
    names = []
    for name in plant.bodies:
        body = model.body(name).id
        chain = set()
        while body:
            chain.add(body)
            body = int(model.body_parentid[body])
        if plant.floating or chain & moving:
            names.append(name)
    return names


def _typical_torque(plant: Plant, rollouts: Sequence[Rollout]) -> np.ndarray:
    """RMS torque of each joint's actuator by the declared model (J,), floored for joints that rest."""
    squares = []
    for rollout in rollouts:
        command = command_inputs(plant, rollout)
        a = np.maximum(plant.actuator, 0)
        prm, gear = plant.model.actuator_biasprm[a], plant.model.actuator_gear[a, 0]
        torque = plant.model.actuator_gainprm[a, 0] * command[:, a] + prm[:, 0]
        torque = gear * (torque + gear * (prm[:, 1] * rollout.joint_pos + prm[:, 2] * rollout.joint_vel))
        squares.append((torque**2).mean(axis=0))
    rms = np.sqrt(np.mean(squares, axis=0))
    return np.maximum(rms, 0.05 * rms.max() + 1e-9)


def _typical_speed(rollouts: Sequence[Rollout]) -> np.ndarray:
    """RMS speed of each joint (J,), floored."""
    rms = np.sqrt(np.mean([(r.joint_vel**2).mean(axis=0) for r in rollouts], axis=0))
    return np.maximum(rms, 0.1 * rms.max() + 1e-6)


def _inertia(plant: Plant) -> np.ndarray:
    """Diagonal of the joint-space inertia at the reference pose (J,)."""
    data = mujoco.MjData(plant.model)
    mujoco.mj_forward(plant.model, data)
    full = np.zeros((plant.model.nv, plant.model.nv))
    mujoco.mj_fullM(plant.model, data, full)
    return np.diag(full)[plant.dof]
