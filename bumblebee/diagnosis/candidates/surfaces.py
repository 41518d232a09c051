"""Contact with a surface that the model lacks: the bodies that may touch one, and how low each of them comes."""

from collections.abc import Sequence

import mujoco
import numpy as np

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.simulation import Plant
from bumblebee.diagnosis.thresholds.candidates import SurfaceSteps
from bumblebee.measured.rollout import Rollout

KIND = "surface_contact"


def surface_candidates(
    plant: Plant, rollouts: Sequence[Rollout], bodies: Sequence[str], rule: SurfaceSteps
) -> list[Candidate]:
    """A candidate on each of the `bodies` of a robot on a fixed base that rises and sinks in the logs.

    A floating base stands on what it stands on. The surface is just below the lowest place of the body, and what
    touches it is the centre of mass until `selection/proposals/surface_contact.py` has found another point.
    """
    if plant.floating or not bodies:
        return []
    bodies = outermost(plant.model, bodies)
    heights = centre_heights(plant, rollouts, bodies, rule.ticks)
    found = []
    for name, low, high in zip(bodies, heights.min(axis=0), heights.max(axis=0), strict=True):
        if high - low > rule.travel:
            centre = plant.model.body_ipos[plant.model.body(name).id]
            nominal = (float(low) - rule.below, *map(float, centre), 1.0)
            deep = rule.below + rule.deep * float(high - low)
            step = (deep, 0.0, 0.0, 0.0, rule.friction - 1.0)
            found.append(Candidate(KIND, name, nominal, step, shape_scale=rule.friction))
    return found


def outermost(model: mujoco.MjModel, bodies: Sequence[str]) -> list[str]:
    """Those of some bodies that carry no other, or only such: a hand and its fingers."""
    ids = [int(model.body(name).id) for name in bodies]
    bare = [b for b in range(model.nbody) if b not in model.body_parentid[1:]]
    tips = [b for b in ids if all(child in bare for child in np.flatnonzero(model.body_parentid == b))]
    return [name for name, b in zip(bodies, ids, strict=True) if b in tips]


def centre_heights(plant: Plant, rollouts: Sequence[Rollout], bodies: Sequence[str], every: int) -> np.ndarray:
    """Heights (T, B) [m] of the bodies' centres of mass at every n-th tick of all rollouts."""
    ids, data = [int(plant.model.body(name).id) for name in bodies], mujoco.MjData(plant.model)
    heights = []
    for rollout in rollouts:
        for joint_pos in rollout.joint_pos[::every]:
            data.qpos[plant.qpos] = joint_pos
            mujoco.mj_kinematics(plant.model, data)
            heights.append(data.xipos[ids, 2].copy())
    return np.array(heights)
