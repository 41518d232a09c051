"""Costs of leaving effects out one at a time, on the windows that the first sentence of a diagnosis is about."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.report.notes import told_horizon
from bumblebee.diagnosis.report.prediction_error import horizon_windows
from bumblebee.diagnosis.simulation import residuals, vary
from bumblebee.sim.effects import Effect


def shares_left_out(
    session: Session, budget: int, whole: Sequence[Effect], less: Sequence[Sequence[Effect]]
) -> list[float | None]:
    """Share of what `whole` takes off the squared error that comes back with each set of `less` in its place.

    Each reading counts in units of its noise; windows that diverge with any of the models are left out.

    Args:
        session: the data; its held-out rollouts are judged, the fitted ones where there are none.
        budget: windows at most.
        whole: all effects.
        less: the same without some of them, each set apart.

    Returns:
        0 to 1 for each of `less`; None where `whole` takes nothing off.
    """
    windows = horizon_windows(session, session.holdout or session.train, budget).windows
    horizon = told_horizon(windows)
    if horizon is None:
        return [None] * len(less)
    models = [vary(session.plant, effects) for effects in ([], whole, *less)]
    raw = residuals(session.plant, session.layout, windows[horizon], models, session.steps[0])[:, :, 0]
    power = ((raw / session.sigma) ** 2).mean(axis=2)
    before, after, *others = power[:, np.isfinite(power).all(axis=0)].sum(axis=1)
    gone = before - after
    return [float(np.clip((other - after) / gone, 0.0, 1.0)) if gone > 0 else None for other in others]


def errors_of(
    session: Session, judged: Sequence[int], budget: int, sets: Sequence[Sequence[Effect]]
) -> NDArray[np.float64]:
    """Error (S,) of the joints' positions with each set of effects: mean of the horizons' log RMS [rad or m].

    Windows that diverge with any of the sets are left out; zeros where no window is left.

    Args:
        session: the data.
        judged: indices of the rollouts.
        budget: windows of a horizon at most.
        sets: S sets of effects.
    """
    windows = horizon_windows(session, judged, budget).windows
    models, places = [vary(session.plant, effects) for effects in sets], session.layout.slices["joint_pos"]
    errors = []
    for part in windows.values():
        raw = residuals(session.plant, session.layout, part, models, session.steps[0])[:, :, 0, places]
        squares = (raw**2).mean(axis=2)
        good = np.isfinite(squares).all(axis=0)
        if good.any():
            errors.append(0.5 * np.log(squares[:, good].mean(axis=1)))
    return np.asarray(np.mean(errors, axis=0)) if errors else np.zeros(len(sets))


def lost_without(effect: Mapping[str, Any]) -> str:
    """An effect's share in words; "-" where it has none."""
    return "-" if effect["explains"] is None else f"{100 * effect['explains']:.0f} %"


def shares_words(document: Mapping[str, Any]) -> str:
    """Say of what a share is one, and to how much the shares of all effects sum."""
    told, known = document.get("summary"), [e["explains"] for e in document["effects"] if e["explains"] is not None]
    where = "held-out rollouts" if document["holdout"] else "fitted rollout"
    on = f"after {told['horizon']} s on the {where}" if told and told["horizon"] else f"on the {where}"
    if not known:
        return f"Together the effects take nothing off the squared error {on}; no share of it is theirs."
    text = (
        f"Lost without it: share of what all effects together take off the squared error {on} (each reading in units "
        "of its noise) that comes back when this one alone is left out."
    )
    total = round(100 * sum(known))
    if len(known) < 2 or total == 100:
        return text
    text += f" The shares sum to {total} %: "
    if total > 100:
        return f"{text}some effects need each other, and each costs what both gain."
    return f"{text}the other {100 - total} % is lost only with several of them, which stand in for each other."
