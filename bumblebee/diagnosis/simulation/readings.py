"""Readings that are compared: measured and simulated, as vectors, and their difference.

The D signals of a tick are joint_pos (J), joint_vel (J) and, on a floating base, base_rot (3, rotation vector in the
measured base frame), base_ang_vel (3), base_lin_vel (3) and, where it was logged, base_pos (3).
"""

from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.thresholds.dataset import Noise
from bumblebee.measured.rollout import Rollout
from bumblebee.quaternions import conjugate, multiply, rotate_by_cross, rotation_vector


@dataclass(frozen=True)
class Layout:
    """Names and columns of the signals."""

    slices: dict[str, slice]
    """Signal name -> its columns."""
    size: int
    """D."""

    def labels(self, joints: tuple[str, ...]) -> list[str]:
        """One name a column, such as `joint_vel left_knee_joint` or `base_pos z`."""
        names = []
        for name, part in self.slices.items():
            kinds = joints if name.startswith("joint") else ("x", "y", "z")
            names += [f"{name} {kinds[i]}" for i in range(part.stop - part.start)]
        return names


def layout_of(plant: Plant, has_base_pos: bool) -> Layout:
    """The signals that this plant and these logs have."""
    count = len(plant.joints)
    widths = {"joint_pos": count, "joint_vel": count}
    if plant.floating:
        widths |= {"base_rot": 3, "base_ang_vel": 3, "base_lin_vel": 3}
        widths |= {"base_pos": 3} if has_base_pos else {}
    slices, at = {}, 0
    for name, width in widths.items():
        slices[name], at = slice(at, at + width), at + width
    return Layout(slices, at)


def measured_readings(rollout: Rollout, layout: Layout) -> tuple[np.ndarray, np.ndarray | None]:
    """Measured signals (T, D), whose base_rot columns are 0, and base_quat (T, 4) or None."""
    out = np.zeros((rollout.frames, layout.size))
    for name, part in layout.slices.items():
        if name != "base_rot":
            out[:, part] = getattr(rollout, name)
    quat = rollout.base_quat
    return out, None if quat is None else quat / np.linalg.norm(quat, axis=-1, keepdims=True)


def smallest_moves(readings: np.ndarray, rule: Noise) -> np.ndarray:
    """Steps (D,) that signals (T, D) are read in: the smallest move of one that often does not move at all; else 0.

    NaN for a signal that never moves: it may be read in any.
    """
    moves = np.abs(np.diff(readings, axis=0))
    out = np.zeros(readings.shape[1])
    for column, steps in enumerate(moves.T):
        nonzero = steps[steps > rule.moves]
        if not len(nonzero):
            out[column] = np.nan
        elif len(nonzero) < rule.resting * len(steps):
            out[column] = np.quantile(nonzero, rule.smallest)
    return out


def simulated_readings(
    plant: Plant, layout: Layout, qpos: np.ndarray, qvel: np.ndarray, offset: np.ndarray
) -> tuple[np.ndarray, np.ndarray | None]:
    """Signals (..., D) of simulated states (..., nq), (..., nv), with the encoder's offset (..., J) added."""
    out = np.zeros((*qpos.shape[:-1], layout.size))
    out[..., layout.slices["joint_pos"]] = qpos[..., plant.qpos] + offset
    out[..., layout.slices["joint_vel"]] = qvel[..., plant.dof]
    if not plant.floating:
        return out, None
    quat = qpos[..., plant.base_qpos + 3 : plant.base_qpos + 7]
    velocity_w, dof = qvel[..., plant.base_dof : plant.base_dof + 3], plant.base_dof
    out[..., layout.slices["base_ang_vel"]] = qvel[..., dof + 3 : dof + 6]
    out[..., layout.slices["base_lin_vel"]] = rotate_by_cross(conjugate(quat), velocity_w)
    if "base_pos" in layout.slices:
        out[..., layout.slices["base_pos"]] = qpos[..., plant.base_qpos : plant.base_qpos + 3]
    return out, quat


def difference(
    layout: Layout, measured: np.ndarray, quat: np.ndarray | None, other: np.ndarray, other_quat: np.ndarray | None
) -> np.ndarray:
    """Return measured - other, (..., D); rotations as the vector that turns `other` into `measured`."""
    out = measured - other
    if quat is not None and other_quat is not None:
        out[..., layout.slices["base_rot"]] = rotation_vector(multiply(conjugate(other_quat), quat))
    return out
