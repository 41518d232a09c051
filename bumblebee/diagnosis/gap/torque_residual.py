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
    Plant,
    Windows,
    choose_starts,
    command_inputs,
    cut,
    declared_values,
    plant_servos,
    residuals,
    vary,
)
from bumblebee.diagnosis.thresholds.gap import MissingTorque
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect, single
from bumblebee.sim.servo import Servos


@dataclass(frozen=True, eq=False)
class TorqueResidual:
    """N short windows of J joints."""

    joints: tuple[str, ...]
    rollout: np.ndarray
    """(N,) index of the rollout."""
    block: np.ndarray
    """(N,) number of the block of time, half a second, that the window lies in, distinct over rollouts."""
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
    """(N, J, B) place within a backlash of B widths that the joint's past motion has left, -1 to 1."""
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
    session: Session,
    ids: Sequence[int],
    effects: Sequence[Effect],
    nuisance: np.ndarray,
    most: int,
    rule: MissingTorque,
) -> TorqueResidual | None:
    """Torques that the declared model with `effects` lacks on the rollouts `ids`; None where none is long enough.

    Args:
        session: the declared model and all rollouts.
        ids: rollouts to use.
        effects: what has been found.
        nuisance: (B,) coefficients of the numerical differences that a fit has found; they are taken out.
        most: windows at most.
        rule: lengths and numbers of the windows.
    """
    plant, layout, steps = session.plant, session.layout, session.steps
    starts = _starts(session, ids, most, rule)
    if len(starts) < rule.fewest:
        return None
    windows = cut(plant, layout, session.rollouts, starts, outputs=1)
    variation = vary(plant, effects)
    left = residuals(plant, layout, windows, [variation], steps[0])[0]
    if np.any(nuisance):
        columns = nuisance_columns(plant, layout, windows, variation, steps[0])
        left = left - np.tensordot(nuisance[: len(columns)], columns, axes=1)
    change = _impulse_responses(session, windows, effects, rule)
    part = layout.slices["joint_vel"]
    good = np.isfinite(left).all(axis=(1, 2)) & np.isfinite(change).all(axis=(1, 2))
    missing = _solve(change[good], left[good, 0, part], rule.ridge)
    kept = [s for s, g in zip(starts, good, strict=True) if g]
    return _described(session, kept, missing, rule)


def _starts(session: Session, ids: Sequence[int], most: int, rule: MissingTorque) -> list[tuple[int, int, int]]:
    """Rollout, first and last row of every window; with rows to spare before and after for position and velocity."""
    rollouts = session.rollouts
    period = float(np.median([np.median(np.diff(rollouts[i].time)) for i in ids]))
    count = min(most, rule.simulations // len(session.plant.joints))
    starts = choose_starts(rollouts, ids, max(rule.span, period), count)
    return [(i, k, last) for i, k, last in starts if k >= 2 and last + 2 < rollouts[i].frames]


def missing_torques(
    session: Session, effects: Sequence[Effect], nuisance: np.ndarray, rule: MissingTorque
) -> tuple[TorqueResidual | None, TorqueResidual | None]:
    """Missing torques of the fitted and of the accepting rollouts; of a lone one its first two thirds and the rest."""
    fitted = [i for i in session.train if i not in session.accept]
    train = torque_residual(session, fitted, effects, nuisance, rule.fitted_windows, rule)
    if session.accept:
        return train, torque_residual(session, session.accept, effects, nuisance, rule.held_windows, rule)
    if train is None:
        return None, None
    late = train.t > np.quantile(train.t, rule.learned_part)
    return _part(train, ~late), _part(train, late)


def _part(data: TorqueResidual, rows: np.ndarray) -> TorqueResidual:
    fixed = ("joints", "creep")
    parts = {n: getattr(data, n) for n in data.__dataclass_fields__}
    return TorqueResidual(**{n: v if n in fixed else v[rows] for n, v in parts.items()})


def _impulse_responses(
    session: Session, windows: Windows, effects: Sequence[Effect], rule: MissingTorque
) -> np.ndarray:
    """(W, J, J): change of the velocities at the windows' ends for 1 N m on each joint, all through the window."""
    plant, layout, step = session.plant, session.layout, session.steps[1]
    part = layout.slices["joint_vel"]
    base = residuals(plant, layout, windows, [vary(plant, effects)], step)[0, :, 0, part]
    inertia = 1.0 / np.maximum(plant.model.dof_invweight0[plant.dof], 1e-9)
    sizes = rule.push * inertia / rule.span
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


def _solve(change: np.ndarray, missed: np.ndarray, ridge: float) -> np.ndarray:
    """Torques (W, J) that explain the missed velocities (W, J); a joint that cannot move gets next to none."""
    scale = np.median(np.abs(np.diagonal(change, axis1=1, axis2=2)), axis=0) + 1e-12
    scaled = change / scale
    normal = np.einsum("wij,wik->wjk", scaled, scaled) + ridge * np.eye(change.shape[1])
    return np.linalg.solve(normal, np.einsum("wij,wi->wj", scaled, missed)[..., None])[..., 0] / scale


def _described(
    session: Session, starts: Sequence[tuple[int, int, int]], missing: np.ndarray, rule: MissingTorque
) -> TorqueResidual:
    """The windows with what the missing torque (N, J) may depend on."""
    plant, rollouts = session.plant, session.rollouts
    used = {s[0] for s in starts}
    servos = {i: plant_servos(plant.of(rollouts[i])) for i in used}
    controls = {i: servos[i].controls(command_inputs(plant, rollouts[i])) for i in used}
    travel = np.max([np.ptp(rollouts[i].joint_pos, axis=0) for i in used], axis=0)
    past = {i: _backlash_states(rollouts[i].joint_pos, travel, rule.backlash) for i in used}
    rows = [_row(rollouts[i], k, last, servos[i], controls[i]) | {"history": past[i][k - 1]} for i, k, last in starts]
    tables = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    times = [_middle(rollouts[i], k, last) for i, k, last in starts]
    spans = [float(rollouts[i].time[last + 1] - rollouts[i].time[k - 1]) for i, k, last in starts]
    block = [i * 1_000_000 + int(time / rule.block) for (i, _, _), time in zip(starts, times, strict=True)]
    sigma = session.sigma[session.layout.slices["joint_pos"]]
    return TorqueResidual(
        joints=plant.joints,
        rollout=np.array([s[0] for s in starts]),
        block=np.unique(np.array(block), return_inverse=True)[1],
        missing=missing,
        t=np.array(times),
        creep=np.maximum(rule.creep * np.sqrt(2.0) * sigma / float(np.median(spans)), rule.least_creep),
        **tables,
    )


def _middle(rollout: Rollout, first: int, last: int) -> float:
    """Time of a window's middle since its rollout began [s]."""
    return 0.5 * (rollout.time[first] + rollout.time[last]) - rollout.time[0]


def _row(rollout: Rollout, first: int, last: int, servos: Servos, controls: np.ndarray) -> dict[str, np.ndarray]:
    """Of one window, by joint (J,): position, velocity, target, its rate, and servo torque."""
    r, given = rollout, servos.given(controls[first - 1 : last + 1])
    inner = [first - 1, *range(first + 1, last), last + 1]
    q = r.joint_pos[inner].mean(axis=0)
    v = (r.joint_pos[last + 1] - r.joint_pos[first - 1]) / (r.time[last + 1] - r.time[first - 1])
    return {
        "q": q,
        "v": v,
        "u": given[1:-1].mean(axis=0),
        "rate": (given[-1] - given[0]) / (r.time[last] - r.time[first - 1]),
        "tau": servos.torque(q, v, controls[first:last].mean(axis=0)),
    }


def _backlash_states(place: np.ndarray, travel: np.ndarray, widths: Sequence[float]) -> np.ndarray:
    """Where (T, J, B) a joint stands in backlashes of B `widths`, shares of its travel, left by its motion (T, J)."""
    half = 0.5 * np.maximum(travel, 1e-6)[:, None] * np.array(widths)
    out = np.empty((*place.shape, len(widths)))
    centre = np.repeat(place[0][:, None], len(widths), axis=1)
    for k, q in enumerate(place):
        centre = np.clip(centre, q[:, None] - half, q[:, None] + half)
        out[k] = (q[:, None] - centre) / half
    return out
