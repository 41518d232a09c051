"""Sizes that first steps follow from are those of the poses logged."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates import all_candidates, scales_of
from tests.diagnosis import arm


def _own_inertia(model: mujoco.MjModel, poses: np.ndarray) -> np.ndarray:
    data, full, found = mujoco.MjData(model), np.zeros((model.nv, model.nv)), []
    for pose in poses:
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, full)
        found.append(np.diag(full).copy())
    return np.mean(found, axis=0)


def test_an_armature_is_sized_by_the_inertia_in_the_poses_logged_not_in_the_reference_pose() -> None:
    """The arm stands upright in its reference pose: its first joint has next to no inertia there."""
    session = arm.session_of(arm.simulate({}, count=1, seconds=2.0))
    plant = session.plant
    bent = [replace(r, joint_pos=r.joint_pos + np.array([0.0, 1.2, 0.3])) for r in session.rollouts]
    inertia = scales_of(plant, bent).inertia
    assert inertia[0] > 3.0 * _own_inertia(plant.model, plant.model.qpos0[None])[0]
    assert inertia == pytest.approx(_own_inertia(plant.model, bent[0].joint_pos), rel=0.02)
    armature = next(c for c in all_candidates(plant, bent, []) if (c.effect, c.where) == ("armature", "j1"))
    assert armature.step[0] == pytest.approx(0.1 * inertia[0])
