"""Which rollouts are fitted: one that shows what no fitted one does takes the place of one that can be spared.

A drive reaches its limit, or loses strength, in few moments of few runs. Where all of these lie in a run that was put
aside, nothing that is fitted can tell of them, however plainly they show. So all rollouts are compared once with the
declared model, restarted every 0.2 s; a run with windows that are far further off than any of a fitted run is exchanged
for a fitted one. The runs that are put aside then lack such moments, too: what happens in few windows is judged by
these (`comparison`'s rule `WhereFelt`). Before that every condition is fitted that can be: other gains tell viscous
friction from the servo's damping, if they take part. Repeats of one motion stay together, and what a condition holds
out stays out.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.dataset.session import Session
from bumblebee.diagnosis.dataset.split import motion_names
from bumblebee.diagnosis.simulation import choose_starts, cut, residuals, vary
from bumblebee.sim.effects import Effect


def informative(session: Session, horizon: float) -> Session:
    """The session with the rollouts exchanged that show what no fitted one does, and a note of each."""
    if len(session.rollouts) < 2:
        return session
    rule = session.thresholds.informative
    names = motion_names(session.rollouts, session.thresholds.split)
    session = _conditions_fitted(session, names)
    errors = window_errors(session, [], horizon, session.steps[1])
    worst = {i: some for i, some in errors.items() if _alone(names, i)}
    for _ in range(rule.exchanges):
        fitted = [i for i in _fitted(session) if i in worst]
        spare = [i for i in _spare(session) if i in worst] or fitted
        aside = [i for i in worst if i not in fitted and (session.held_out is None or i not in session.holdout)]
        if not spare or not aside:
            break
        most = max(worst[i][0] for i in fitted)
        shows = {i: worst[i][min(rule.several, len(worst[i])) - 1] for i in aside if len(worst[i]) >= rule.several}
        one = max(shows, key=lambda i: shows[i], default=None)
        if one is None or shows[one] < rule.far * most:
            break
        why = "contains excitation that no fitted rollout has"
        session = _exchanged(session, one, min(spare, key=lambda i: worst[i][0]), why)
    return session


def _conditions_fitted(session: Session, names: Sequence[str]) -> Session:
    """The session with a rollout fitted of every condition of which it can be; all where one is held out by itself."""
    if session.held_out is not None:
        return session
    for one in range(len(session.rollouts)):
        known = {_condition(session, i) for i in _fitted(session)}
        spare = [i for i in _spare(session) if _alone(names, i)]
        if _condition(session, one) not in known and _alone(names, one) and spare:
            why = "was recorded under a condition that no fitted rollout has"
            session = _exchanged(session, one, max(spare, key=lambda i: (_together(session, i), -i)), why)
    return session


def _fitted(session: Session) -> list[int]:
    """Rollouts that are fitted, and do not decide."""
    return [i for i in session.train if i not in session.accept]


def _spare(session: Session) -> list[int]:
    """Those of the fitted rollouts whose condition others of them have, too."""
    return [i for i in _fitted(session) if _together(session, i) > 1]


def _together(session: Session, i: int) -> int:
    """How many fitted rollouts have the condition of rollout `i`."""
    return [_condition(session, k) for k in _fitted(session)].count(_condition(session, i))


def _condition(session: Session, i: int) -> int:
    """The condition of a rollout, 0 for the declared one."""
    return session.plant.under.get(session.rollouts[i].rollout_id, 0)


def _alone(names: Sequence[str], i: int) -> bool:
    """Whether a rollout has no repeats, or all are of one motion, so that these are parted anyway."""
    return names.count(names[i]) == 1 or len(set(names)) == 1


def _exchanged(session: Session, one: int, other: int, why: str) -> Session:
    """The session with two rollouts in each other's place, and a note of why."""

    def swapped(ids: Sequence[int]) -> list[int]:
        return sorted({one: other, other: one}.get(i, i) for i in ids)

    name, old = session.ids([one, other])
    note = f"{name} {why}: it is fitted instead of {old}"
    return replace(
        session,
        train=swapped(session.train),
        holdout=swapped(session.holdout),
        accept=swapped(session.accept),
        notes=[*session.notes, note],
    )


def window_errors(session: Session, effects: Sequence[Effect], horizon: float, step: float) -> dict[int, np.ndarray]:
    """Squared errors of each rollout's windows with `effects`, in steps of `step` [s]; largest first, 1 is usual.

    Every signal is compared with its usual error at the same time after the start; a window that diverged is left out.
    """
    ids = range(len(session.rollouts))
    starts = choose_starts(
        session.rollouts, ids, horizon, session.thresholds.informative.windows, session.plant.thresholds.windows
    )
    if not starts:
        return {}
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    raw = residuals(session.plant, session.layout, windows, [vary(session.plant, effects)], step)[0]
    raw = raw[:, 1:] if raw.shape[1] > 1 else raw
    good = np.isfinite(raw).all(axis=(1, 2))
    if not good.any():
        return {}
    raw, rollout = raw[good], windows.rollout[good]
    usual = np.median(np.abs(raw), axis=0) + session.sigma
    error = np.mean((raw / usual) ** 2, axis=(1, 2))
    parts = {i: np.sort(error[rollout == i])[::-1] for i in ids}
    return {i: part for i, part in parts.items() if len(part)}
