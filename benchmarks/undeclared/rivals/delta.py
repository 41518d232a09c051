"""A delta action alone: what is added to every joint's target, a small regression on the joint's own state.

The change of target is a linear combination of a constant, position, velocity, direction, target error and two bends, a
joint, and acts at every control tick. Its weights are fitted by ridge regression of the windows' whitened residual on
the weights' effects in the simulator, the penalty by cross-validation over windows. It names no effect.
"""

import numpy as np
from mujoco.batch import Batch

from benchmarks.undeclared.rivals.common import Answer
from benchmarks.undeclared.rivals.ridge import cross_validated
from benchmarks.undeclared.sight import error_of
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.simulation import difference, simulated_readings
from bumblebee.stand_in.undeclared.declared import Declared

_TICK = 0.02  # [s]
_FEATURES = 7
_SIZES = np.array([0.01, 0.01, 0.002, 0.005, 0.02, 0.01, 0.001])
"""A small weight of each feature."""
_BOUND = 0.3  # largest change of a target [rad]
_ROUNDS = 2


def run(robot: Declared, problem: Problem, rng: np.random.Generator) -> Answer:
    """Fit the weights (J, F)."""
    joints = len(robot.joints)
    weights = np.zeros((joints, _FEATURES))
    for _ in range(_ROUNDS):
        now = residual(problem, weights)
        columns = []
        for j in range(joints):
            for f in range(_FEATURES):
                nudged = weights.copy()
                nudged[j, f] += _SIZES[f]
                columns.append(residual(problem, nudged) - now)
        step = cross_validated(np.array(columns), now, rng).reshape(joints, _FEATURES) * _SIZES
        costs = {share: (residual(problem, weights + share * step) ** 2).mean() for share in (1.0, 0.3, 0.0)}
        share = min(costs, key=costs.get)
        if share == 0.0:
            break
        weights = weights + share * step
    return Answer([], lambda other: error_of(other, residual(other, weights)))


def features(q: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(W, J, F) of positions [rad], velocities [rad/s] and targets [rad], (W, J) each."""
    return np.stack((np.ones_like(q), q, v, np.tanh(v / 0.05), u - q, np.sin(3 * q), v * np.abs(v)), axis=-1)


def residual(problem: Problem, weights: np.ndarray) -> np.ndarray:
    """Whitened residual (W, M) of the model under the delta action."""
    plant, windows = problem.plant, problem.windows
    ticks = np.round(windows.out_time[0] / _TICK).astype(int)
    model, steps = plant.model, round(_TICK / problem.fine)
    model.opt.timestep = problem.fine
    batch = Batch(model, len(windows), 1)
    qpos, qvel, control = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")
    qpos[:], qvel[:] = windows.qpos, windows.qvel
    seen = {}
    for tick in range(int(ticks.max())):
        u = _targets(problem, tick * _TICK)[:, plant.actuator]
        table = features(qpos[:, plant.qpos], qvel[:, plant.dof], u)
        control[:, plant.actuator] = u + np.clip(np.einsum("jf,wjf->wj", weights, table), -_BOUND, _BOUND)
        batch.step(nstep=steps)
        seen[tick + 1] = qpos.copy(), qvel.copy()
    at_q, at_v = (np.stack([seen[t][i] for t in ticks], axis=1) for i in (0, 1))
    offset = np.zeros((len(windows), 1, len(plant.joints)))
    simulated, quat = simulated_readings(plant, problem.layout, at_q, at_v, offset)
    raw = difference(problem.layout, windows.measured, windows.quat, simulated, quat)
    bad = ~np.isfinite(raw).all(axis=(1, 2))
    out = problem.whitener(raw[None])[0]
    out[bad] = 30.0
    return out


def _targets(problem: Problem, time: float) -> np.ndarray:
    """Commands (W, nu) in force `time` after the windows' starts."""
    windows = problem.windows
    rows = [np.searchsorted(t, time + 1e-6, side="right") - 1 for t in windows.command_time]
    return windows.command[np.arange(len(windows)), np.maximum(rows, 0)]
