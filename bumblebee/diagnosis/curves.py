"""Measured curves: the mean of a joint's missing torque over one quantity, in equally filled bins, with intervals."""

import numpy as np

from bumblebee.diagnosis.structure import clipped
from bumblebee.diagnosis.torque_residual import TorqueResidual

_BINS, _FEWEST = 15, 8


def measured_curve(x: np.ndarray, y: np.ndarray, block: np.ndarray) -> list[list[float]]:
    """Rows [x, mean, half-width of its 95 % interval] of `y` (N,) over `x` (N,); what lies in one block counts once."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, _BINS + 1)))
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    rows = []
    for b in range(len(edges) - 1):
        mine = which == b
        blocks = len(np.unique(block[mine]))
        if mine.sum() >= _FEWEST and blocks > 1:
            half = 1.96 * float(y[mine].std()) / np.sqrt(blocks)
            rows.append([float(np.median(x[mine])), float(y[mine].mean()), float(half)])
    return rows


def joint_curves(data: TorqueResidual, joint: int) -> dict[str, list[list[float]]]:
    """Curves over the joint's own velocity, position, torque and time, by their name and unit."""
    y = clipped(data.missing[:, joint])
    over = {
        "velocity [rad/s]": data.v[:, joint],
        "position [rad]": data.q[:, joint],
        "torque [N m]": data.tau[:, joint],
        "time [s]": data.t,
    }
    return {name: measured_curve(x, y, data.block) for name, x in over.items() if np.ptp(x) > 0}
