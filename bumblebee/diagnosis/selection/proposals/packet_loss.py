"""Packet loss, commands that never arrived: a likelihood of each window's course over all ways to lose its commands.

A lost command leaves the one before in force for a tick. What that does to a window's readings is simulated for every
tick and every length of a run of losses; to first order the effects of several add up, so that the residual of a window
has a likelihood under each of the 2^T patterns of its T ticks. With commands lost at random with the share p the
patterns' prior is p^k (1 - p)^(T - k). Summed over patterns this gives the likelihood of p, against p = 0 a test that
needs no mean effect: a single lost command is as plain as a single kick. The most likely pattern says what the drives
really got, and the rest of the diagnosis goes on with that.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.comparison import Holdout, criterion
from bumblebee.diagnosis.estimation import Fit, gauss_newton
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection.changes import Asking, Loss, Lost
from bumblebee.diagnosis.selection.proposals.loss_likelihoods import LossLikelihoods
from bumblebee.diagnosis.selection.proposals.setpoints import explains_more
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.simulation import Windows, residuals, select, vary
from bumblebee.sim.effects import Effect


def packet_loss_of(problem: Problem, holdout: Holdout, fit: Fit) -> tuple[Loss, Problem, Holdout] | None:
    """Commands lost, conditional on the fit, and the windows with the commands that arrived; None for none."""
    rule = problem.thresholds.selection.proposals.packet_loss
    clean = fit.clean(problem)
    places = _places(problem, fit, clean)
    if not places:
        return None
    tried = [(loss_likelihoods(problem, fit.effects, clean, place), place) for place in places]
    gains = [losses.total(losses.best) for losses, _ in tried]
    best = int(np.argmax(gains))
    place, least = tried[best][1], rule.least_gain + np.log(len(places))
    if gains[best] < least:
        return None
    losses, fit, clean = _settled(problem, fit, tried[best][0], place)
    share = losses.best
    gain = losses.total(share)
    lost = losses.likely(share)
    if gain < least or not lost.any():
        return None
    fitted = arrived(problem, lost, place)
    if _cleared(clean, _clean(fitted, fit), np.any(lost, axis=1)) < rule.cleared:
        return None
    found = Loss(place, share, losses.interval(share), gain, np.inf, 1.0)
    if holdout.problem is not None:
        seen = _seen_again(holdout.problem, fit, found)
        if seen is None:
            return None
        found, kept = seen
        holdout = replace(holdout, problem=kept)
    elif place and gain < rule.sure_gain:
        return None  # a joint's own loss may not be believed as easily where it cannot be seen again
    return found, fitted, holdout


def _settled(
    problem: Problem, fit: Fit, losses: LossLikelihoods, place: str
) -> tuple[LossLikelihoods, Fit, np.ndarray]:
    """Likelihoods, the fit and its residual (W, M), the fit made anew on the commands that arrived.

    What many lost commands do on the mean is a delay, to which numerical differences and the place's effects have been
    bent. So the way is also gone from without these on, and the one that ends nearer to the data counts.
    """
    rest, changes = fit.without([c for c in fit.chosen if c.where == place]), losses.changes
    bare = replace(rest, nuisance=0.0 * fit.nuisance, residual=problem.residual([rest.effects])[0])
    known = loss_likelihoods(problem, bare.effects, bare.clean(problem), place, changes)
    ends = [_arriving(problem, *start, place) for start in ((fit, losses), (bare, known))]
    return min(ends, key=lambda end: end[1].cost + 2.0 * end[0].price(end[0].best))


def _arriving(
    problem: Problem, fit: Fit, losses: LossLikelihoods, place: str
) -> tuple[LossLikelihoods, Fit, np.ndarray]:
    """Fit and commands that arrived, found in turn."""
    rule, clean = problem.thresholds.selection.proposals.packet_loss, fit.clean(problem)
    for _ in range(rule.rounds):
        kept = arrived(problem, losses.likely(losses.best), place)
        residual = kept.residual([fit.effects])[0]
        weights = window_weights(residual - np.tensordot(fit.nuisance, kept.nuisance, axes=1))
        fit = gauss_newton(kept, fit.chosen, fit.values, weights, iterations=1, coarse=True)
        clean = problem.residual([fit.effects])[0] - np.tensordot(fit.nuisance, problem.nuisance, axes=1)
        losses = loss_likelihoods(problem, fit.effects, clean, place, losses.changes)
        fit = replace(fit, cost=float((_clean(arrived(problem, losses.likely(losses.best), place), fit) ** 2).sum()))
    return losses, fit, clean


def _places(problem: Problem, fit: Fit, clean: np.ndarray) -> list[str]:
    """Where commands may have been lost: "" for all joints at once, and joints; none where nothing hints at it."""
    rule = problem.thresholds.selection.proposals.packet_loss
    driven = [j for j, a in zip(problem.plant.joints, problem.plant.actuator, strict=True) if a >= 0]
    power = (clean**2).mean(axis=1)
    odd = np.flatnonzero(power > rule.odd_power)
    if not driven or not 1 <= _ticks(problem.windows) <= rule.most_ticks:
        return []
    if odd.size < rule.least_odd or np.median(power) > rule.most_usual_power:
        return []
    places = [""] + (driven if 1 < len(driven) <= rule.most_joints else [])
    if odd.size < rule.few_odd * len(power):
        some = problem.part(odd)  # what these do not show at all the others need not be simulated for
        seen = [loss_likelihoods(some, fit.effects, clean[odd], place) for place in places]
        if max(losses.total(losses.best) for losses in seen) < rule.hint:
            return []
    return places


def _seen_again(problem: Problem, fit: Fit, found: Loss) -> tuple[Loss, Problem] | None:
    """The loss with what the held-out windows say of it, and these with the commands that arrived; None if against."""
    rule = problem.thresholds.selection.proposals.packet_loss
    left = _clean(problem, fit)
    seen = loss_likelihoods(problem, fit.effects, left, found.where)
    paid = seen.total(found.share)
    # A bus that loses whole rows is usual, a joint that loses its own is not: that must be seen again.
    if paid < rule.held_out_gain and (found.where or found.gain < rule.sure_gain or paid < rule.contradiction):
        return None
    kept = arrived(problem, seen.likely(found.share), found.where)
    explains = _explained(left, _clean(kept, fit))
    if found.where and explains < rule.own_explained:
        return None
    return replace(found, paid=paid, explains=explains), kept


def loss_likelihoods(
    problem: Problem, effects: Sequence[Effect], clean: np.ndarray, place: str, changes: np.ndarray | None = None
) -> LossLikelihoods:
    """Likelihoods of the residuals `clean` (W, M) under all patterns of losses, on a joint or ("") on all at once."""
    rule, ticks = problem.thresholds.selection.proposals.packet_loss, _ticks(problem.windows)
    patterns = np.array(list(itertools.product([False, True], repeat=ticks)))
    runs = _runs(patterns, rule.longest)
    changes = _changes(problem, effects, place, ticks) if changes is None else changes
    usual = max(float(np.median((clean**2).mean(axis=1))), 1.0)
    lengths = range(1, rule.longest + 1)
    table = np.stack([runs == length for length in lengths], axis=1).reshape(len(patterns), -1)
    table = table.astype(np.float32)  # (P, L * T) of L lengths of a run
    flat = changes.reshape(-1, *clean.shape).transpose(1, 0, 2)  # (W, L * T, M)
    linear = np.einsum("wkm,wm->wk", flat, clean, optimize=True)
    square = np.matmul(flat, flat.transpose(0, 2, 1)).astype(np.float32)
    logs = np.empty((len(clean), len(patterns)))
    for w in range(len(clean)):
        logs[w] = (table @ linear[w] - 0.5 * ((table @ square[w]) * table).sum(axis=1)) / usual
    return LossLikelihoods(patterns, logs, rule, changes)


def arrived(problem: Problem, lost: np.ndarray, place: str) -> Problem:
    """The problem with the commands that were in force: for a lost one (W, T) that of the tick before."""
    windows = problem.windows
    command, first = windows.command.copy(), _first(windows)
    columns = _columns(problem, place)
    for w in range(len(windows)):
        for t in np.flatnonzero(lost[w]):
            k = first[w] + t
            command[w, k, columns] = command[w, k - 1, columns]
    return replace(problem, windows=replace(windows, command=command), read=replace(problem.read, command=command))


def _changes(problem: Problem, effects: Sequence[Effect], place: str, ticks: int) -> np.ndarray:
    """(L, T, W, M) whitened change of the prediction where tick t has the command of 1, 2, 3 ticks before."""
    longest = problem.thresholds.selection.proposals.packet_loss.longest
    windows, columns = problem.windows, _columns(problem, place)
    first, rows = _first(windows), np.arange(len(windows))
    variation = [vary(problem.plant, effects)]
    step = problem.coarse

    usual = residuals(problem.plant, problem.layout, windows, variation, step)[0]

    def simulate(command: np.ndarray) -> np.ndarray:
        raw, others = usual.copy(), (command != windows.command).any(axis=(1, 2))
        if others.any():
            some = select(replace(windows, command=command), others)
            raw[others] = residuals(problem.plant, problem.layout, some, variation, step)[0]
        return problem.whitener(raw, centre=False)

    base = problem.whitener(usual, centre=False)
    out = np.zeros((longest, ticks, *base.shape), dtype=np.float32)
    for length, t in itertools.product(range(1, longest + 1), range(ticks)):
        command = windows.command.copy()
        at = (first + t)[:, None]
        command[rows[:, None], at, columns] = windows.command[rows[:, None], np.maximum(at - length, 0), columns]
        out[length - 1, t] = base - simulate(command)
    return out


def _columns(problem: Problem, place: str) -> np.ndarray:
    plant = problem.plant
    return plant.actuator[plant.actuator >= 0] if not place else plant.actuator[[plant.joints.index(place)]]


def _first(windows: Windows) -> np.ndarray:
    """(W,) row of the command issued before that of each window's start: had it arrived, a lost first one shows it."""
    return np.array([max(int(np.searchsorted(time, -1e-9)) - 1, 0) for time in windows.command_time])


def _ticks(windows: Windows) -> int:
    """T: commands issued within the shortest window, from the one before its start on."""
    first = _first(windows)
    counts = [int((time[k:] < last - 1e-9).sum()) for time, k, last in zip(
        windows.command_time, first, windows.out_time[:, -1], strict=True)]  # fmt: skip
    return min(counts)


def _runs(patterns: np.ndarray, longest: int) -> np.ndarray:
    """(P, T) how many commands in a row were lost up to each tick, at most `longest`; 0 for one that arrived."""
    out = np.zeros(patterns.shape, dtype=int)
    for t in range(patterns.shape[1]):
        before = out[:, t - 1] if t else 0
        out[:, t] = np.where(patterns[:, t], np.minimum(before + 1, longest), 0)
    return out


def _clean(problem: Problem, fit: Fit) -> np.ndarray:
    """Residual (W, M) of the fit's effects on a problem's windows, the fit's nuisances taken out."""
    return problem.residual([fit.effects])[0] - np.tensordot(fit.nuisance, problem.nuisance, axes=1)


def _cleared(before: np.ndarray, after: np.ndarray, some: np.ndarray) -> float:
    """Share of the excess of log(1 + power) over noise that goes in some windows (W,)."""
    logs = [np.log1p((x[some] ** 2).mean(axis=1)) for x in (before, after)]
    return float((logs[0] - logs[1]).sum() / max((logs[0] - np.log(2.0)).sum(), 1e-12))


def _explained(before: np.ndarray, after: np.ndarray) -> float:
    """Share of the excess of chi-square."""
    power = [float((x**2).mean()) for x in (before, after)]
    return float(np.clip((power[0] - power[1]) / max(power[0] - 1.0, 1e-12), 0.0, 1.0))


def find_packet_loss(run: SearchState) -> Asking[bool]:
    """Look for packet loss; if some commands never arrived, go on with those that did.

    Not where a drive that follows its targets late or slowly explains more: such a one, too, is late here and there.
    """
    found = None if run.loss else packet_loss_of(run.problem, run.holdout, run.fit)
    if found is None:
        return False
    loss, problem, holdout = found
    fit = gauss_newton(problem, run.fit.chosen, run.fit.values, run.weights, iterations=2, coarse=True)
    gain = criterion(problem, fit) - criterion(run.problem, run.fit) - _told(problem.windows, loss.share)
    if explains_more(run, loss.where, gain):
        return False
    yield Lost(loss, problem, holdout, fit)
    return True


def _told(windows: Windows, share: float) -> float:
    """Log-likelihood that it costs to say of every command of the windows whether it was lost."""
    entropy = -share * np.log(share) - (1 - share) * np.log1p(-share)
    return float(len(windows) * _ticks(windows) * entropy)
