"""The torque that a model lacks, joint by joint, along the logs, and what it may depend on.

A window of a few hundredths of a second restarts from the measured state. By how much the velocities at its end miss
the measured ones, divided by what a unit of torque would have changed them, is the mean torque that the model lacks
there. It goes through contact and servo as the simulation does. The readings that a residual is made of are not used to
say where the joint was: the noise of a reading in both would look like friction or a spring.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.residuals import nuisance_columns
from bumblebee.diagnosis.simulation import (
    Layout,
    Plant,
    Windows,
    choose_starts,
    command_inputs,
    cut,
    declared_values,
    residuals,
    vary,
)
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect, single
from bumblebee.sim.servo import servos_of

SPAN = 0.04  # [s] of a window, or one tick where ticks are longer
BLOCK = 0.5  # [s]: what lies closer in one rollout is not taken for independent
_PULSES = 60_000  # simulations of one window for one joint that are affordable


@dataclass(frozen=True, eq=False)
class TorqueResidual:
    """N short windows of J joints."""

    joints: tuple[str, ...]
    rollout: np.ndarray
    """(N,) index of the rollout."""
    block: np.ndarray
    """(N,) number of the half second that the window lies in, distinct over rollouts."""
    missing: np.ndarray
    """(N, J) mean torque that the model lacks [N m]."""
    q: np.ndarray
    """(N, J) position [rad], from readings that the residual is not made of."""
    v: np.ndarray
    """(N, J) velocity [rad/s], from positions before and after the window."""
    u: np.ndarray
    """(N, J) mean target [rad] or commanded torque [N m]; 0 for a passive joint."""
    rate: np.ndarray
    """(N, J) rate of the target over the window [rad/s]."""
    tau: np.ndarray
    """(N, J) servo torque by the declared gains [N m]."""
    t: np.ndarray
    """(N,) time since the rollout began [s]."""
    history: np.ndarray
    """(N, J, 3) place within a play of 1, 3 and 10 % of the joint's travel that its past motion has left, -1 to 1."""
    creep: np.ndarray
    """(J,) speed [rad/s] below which the direction of motion is not known."""

    def __len__(self) -> int:
        return len(self.rollout)

    def values(self, joint: int) -> dict[str, np.ndarray]:
        """The names of `sim.effects.terms` as this joint sees them."""
        own = {name: getattr(self, name)[:, joint] for name in ("q", "v", "u", "tau")}
        others = {f"{s}[{n}]": getattr(self, s)[:, k] for s in ("q", "v") for k, n in enumerate(self.joints)}
        return own | {"t": self.t} | others


def torque_residual(
    plant: Plant,
    layout: Layout,
    rollouts: Sequence[Rollout],
    ids: Sequence[int],
    effects: Sequence[Effect],
    nuisance: np.ndarray,
    sigma: np.ndarray,
    steps: tuple[float, float],
    most: int = 4000,
) -> TorqueResidual | None:
    """Torques that the declared model with `effects` lacks on the rollouts `ids`; None where none is long enough.

    Args:
        plant: the declared model.
        layout: its signals.
        rollouts: all rollouts.
        ids: those to use.
        effects: what has been found.
        nuisance: (B,) coefficients of the numerical differences that a fit has found; they are taken out.
        sigma: (D,) noise of the readings.
        steps: simulation step [s] for residuals and for sensitivities.
        most: windows at most.
    """
    period = float(np.median([np.median(np.diff(rollouts[i].time)) for i in ids]))
    count = len(plant.joints)
    starts = choose_starts(rollouts, ids, max(SPAN, period), min(most, _PULSES // count))
    starts = [(i, k, last) for i, k, last in starts if k >= 2 and last + 2 < rollouts[i].frames]
    if len(starts) < 60:
        return None
    windows = cut(plant, layout, rollouts, starts, outputs=1)
    variation = vary(plant, effects)
    left = residuals(plant, layout, windows, [variation], steps[0])[0]
    if np.any(nuisance):
        columns = nuisance_columns(plant, layout, windows, variation, steps[0])
        left = left - np.tensordot(nuisance[: len(columns)], columns, axes=1)
    change = _answers(plant, layout, windows, effects, steps[1])
    part = layout.slices["joint_vel"]
    good = np.isfinite(left).all(axis=(1, 2)) & np.isfinite(change).all(axis=(1, 2))
    missing = _solve(change[good], left[good, 0, part])
    kept = [s for s, g in zip(starts, good, strict=True) if g]
    return _described(plant, rollouts, kept, missing, sigma[layout.slices["joint_pos"]])


def missing_torques(
    session: Session, effects: Sequence[Effect], nuisance: np.ndarray
) -> tuple[TorqueResidual | None, TorqueResidual | None]:
    """Missing torques of the fitted and of the accepting rollouts; of a lone one its first two thirds and the rest."""

    def lacking(ids: Sequence[int], most: int) -> TorqueResidual | None:
        plant, layout, rollouts = session.plant, session.layout, session.rollouts
        return torque_residual(plant, layout, rollouts, ids, effects, nuisance, session.sigma, session.steps, most)

    train = lacking([i for i in session.train if i not in session.accept], 4000)
    if session.accept:
        return train, lacking(session.accept, 2000)
    if train is None:
        return None, None
    late = train.t > np.quantile(train.t, 2 / 3)
    return _part(train, ~late), _part(train, late)


def _part(data: TorqueResidual, rows: np.ndarray) -> TorqueResidual:
    fixed = ("joints", "creep")
    parts = {n: getattr(data, n) for n in data.__dataclass_fields__}
    return TorqueResidual(**{n: v if n in fixed else v[rows] for n, v in parts.items()})


def _answers(plant: Plant, layout: Layout, windows: Windows, effects: Sequence[Effect], step: float) -> np.ndarray:
    """(W, J, J): change of the velocities at the windows' ends for 1 N m on each joint, all through the window."""
    part = layout.slices["joint_vel"]
    base = residuals(plant, layout, windows, [vary(plant, effects)], step)[0, :, 0, part]
    inertia = 1.0 / np.maximum(plant.model.dof_invweight0[plant.dof], 1e-9)
    sizes = 0.1 * inertia / SPAN  # 0.1 rad/s on a free joint
    out = np.empty((len(windows), len(sizes), len(sizes)))
    for j, size in enumerate(sizes):
        pushed = vary(plant, _pushed(plant, effects, plant.joints[j], size))
        out[:, :, j] = (base - residuals(plant, layout, windows, [pushed], step)[0, :, 0, part]) / size
    return out


def _pushed(plant: Plant, effects: Sequence[Effect], joint: str, torque: float) -> list[Effect]:
    """The effects with a constant torque on a joint, in place of or beside the spring that it has."""
    stiffness, preload = declared_values(plant, "joint_spring", joint)
    rest = []
    for effect in effects:
        if effect.effect == "joint_spring" and joint in effect.where:
            stiffness, preload = effect.values()
            rest += [replace(effect, where=(place,)) for place in effect.where if place != joint]
        else:
            rest.append(effect)
    return [*rest, single("joint_spring", joint, stiffness, preload + torque)]


def _solve(change: np.ndarray, missed: np.ndarray) -> np.ndarray:
    """Torques (W, J) that explain the missed velocities (W, J); a joint that cannot answer gets next to none."""
    scale = np.median(np.abs(np.diagonal(change, axis1=1, axis2=2)), axis=0) + 1e-12
    scaled = change / scale
    normal = np.einsum("wij,wik->wjk", scaled, scaled) + 1e-3 * np.eye(change.shape[1])
    return np.linalg.solve(normal, np.einsum("wij,wi->wj", scaled, missed)[..., None])[..., 0] / scale


def _described(
    plant: Plant,
    rollouts: Sequence[Rollout],
    starts: Sequence[tuple[int, int, int]],
    missing: np.ndarray,
    sigma: np.ndarray,
) -> TorqueResidual:
    servos = servos_of(plant.model, [int(plant.model.joint(name).id) for name in plant.joints])
    given = {i: servos.given(servos.controls(command_inputs(plant, rollouts[i]))) for i in {s[0] for s in starts}}
    controls = {i: servos.controls(command_inputs(plant, rollouts[i])) for i in given}
    travel = np.max([np.ptp(rollouts[i].joint_pos, axis=0) for i in given], axis=0)
    past = {i: _play(rollouts[i].joint_pos, travel) for i in given}
    rows: dict[str, list[np.ndarray]] = {name: [] for name in ("q", "v", "u", "rate", "tau", "history")}
    time, block, spans = [], [], []
    for i, k, last in starts:
        r = rollouts[i]
        inner = [k - 1, *range(k + 1, last), last + 1]
        span = r.time[last + 1] - r.time[k - 1]
        q = r.joint_pos[inner].mean(axis=0)
        v = (r.joint_pos[last + 1] - r.joint_pos[k - 1]) / span
        rows["q"].append(q)
        rows["v"].append(v)
        rows["u"].append(given[i][k:last].mean(axis=0))
        rows["rate"].append((given[i][last] - given[i][k - 1]) / (r.time[last] - r.time[k - 1]))
        rows["tau"].append(servos.torque(q, v, controls[i][k:last].mean(axis=0)))
        rows["history"].append(past[i][k - 1])
        centre = 0.5 * (r.time[k] + r.time[last]) - r.time[0]
        time.append(centre)
        block.append(i * 1_000_000 + int(centre / BLOCK))
        spans.append(span)
    creep = np.maximum(4.0 * np.sqrt(2.0) * sigma / float(np.median(spans)), 1e-4)
    tables = {name: np.array(values) for name, values in rows.items()}
    return TorqueResidual(
        joints=plant.joints,
        rollout=np.array([s[0] for s in starts]),
        block=np.unique(np.array(block), return_inverse=True)[1],
        missing=missing,
        t=np.array(time),
        creep=creep,
        **tables,
    )


def _play(place: np.ndarray, travel: np.ndarray) -> np.ndarray:
    """Where (T, J, 3) a joint stands in plays of 1, 3 and 10 % of its travel, pushed along by its motion (T, J)."""
    half = 0.5 * np.maximum(travel, 1e-6)[:, None] * np.array([0.01, 0.03, 0.1])
    out = np.empty((*place.shape, 3))
    centre = np.repeat(place[0][:, None], 3, axis=1)
    for k, q in enumerate(place):
        centre = np.clip(centre, q[:, None] - half, q[:, None] + half)
        out[k] = (q[:, None] - centre) / half
    return out
