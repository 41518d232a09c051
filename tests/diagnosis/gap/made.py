"""Missing torques of two joints, of a form that a test states."""

import numpy as np

from bumblebee.diagnosis.gap.torque_residual import TorqueResidual

JOINTS = ("hip", "knee")


def data(missing: object, seed: int, noise: float = 0.3, seconds: float = 60.0) -> TorqueResidual:
    """Windows of 0.04 s along smooth motions; `missing(q, v, tau, t)` is the torque that the hip lacks."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 0.04)
    amp, freq, phase = rng.uniform(0.2, 0.5, (3, 2)), rng.uniform(0.1, 0.8, (3, 2)), rng.uniform(0, 6.28, (3, 2))
    angle = 2 * np.pi * freq * t[:, None, None] + phase
    q, v = (amp * np.sin(angle)).sum(axis=1), (2 * np.pi * freq * amp * np.cos(angle)).sum(axis=1)
    u = q + 0.1 * v + 0.05 * rng.standard_normal(q.shape).cumsum(axis=0) / 30
    tau = 30 * (u - q) - 1.0 * v
    lacks = noise * rng.standard_normal(q.shape)
    lacks[:, 0] += missing(q, v, tau[:, 0], t) if missing else 0.0
    zeros = np.zeros((*q.shape, 3))
    block = np.unique((t / 0.5).astype(int), return_inverse=True)[1]
    return TorqueResidual(JOINTS, np.zeros(len(t), int), block, lacks, q, v, u, v, tau, t, zeros, np.full(2, 0.02))
