"""The errors that a diagnosis prints: of the declared and of the corrected model on held-out rollouts, by horizon.

They judge, too. A correction that is surely better at no horizon and surely worse at one is withdrawn, with a note.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.report.prediction_error import (
    block_of,
    floor_block,
    horizon_whiteners,
    horizon_windows,
    window_residuals,
)
from bumblebee.diagnosis.report.removed_error import Ends, removed
from bumblebee.diagnosis.simulation import vary
from bumblebee.diagnosis.thresholds.report import Refuted
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class PrintedErrors:
    """The contract's block `error`, what is gone of it, and the residuals that both are of."""

    block: dict[str, Any]
    removed: dict[str, list[dict[str, Any]]]
    """By horizon, see `removed_error`."""
    ends: Ends


def printed_errors(session: Session, effects: Sequence[Effect], config: DiagnosisConfig) -> PrintedErrors:
    """Of the declared model, of that with `effects`, and what sensor noise alone leaves."""
    ids, rules = session.holdout or session.train, config.thresholds.report
    cuts = horizon_windows(session, ids, config.report_windows, rules.prediction_error)
    after = vary(session.plant, effects)
    whiteners = horizon_whiteners(cuts, after, session.sigma, session.steps[1], config.seed)
    declared = window_residuals(cuts, vary(session.plant, []), session.steps[0])
    corrected = window_residuals(cuts, after, session.steps[0]) if effects else declared
    block = {
        "before": block_of(cuts, whiteners, declared, config.seed),
        "after": block_of(cuts, whiteners, corrected, config.seed),
        "floor": floor_block(cuts, whiteners, session.sigma, config.seed),
    }
    ends = Ends(cuts, declared, corrected)
    return PrintedErrors(block, removed(ends, block, rules.matters, config.seed), ends)


def surely_better(gone: Mapping[str, Sequence[Mapping[str, Any]]], rule: Refuted) -> list[str]:
    """Horizons at which some error is smaller, with its whole interval where there is one, and none surely larger."""
    return [name for name, every in gone.items() if any(map(_smaller, every)) and not _any_larger(every, rule)]


def surely_worse(gone: Mapping[str, Sequence[Mapping[str, Any]]], rule: Refuted) -> list[str]:
    """Horizons at which some error is larger, by more than a trifle and with its whole interval where there is one."""
    return [name for name, every in gone.items() if _any_larger(every, rule)]


def _smaller(entry: Mapping[str, Any]) -> bool:
    if entry["share"] is None:
        return False
    return bool((entry["ci95"][0] if entry["ci95"] else entry["share"]) > 0)


def _any_larger(entries: Sequence[Mapping[str, Any]], rule: Refuted) -> bool:
    return any(_larger(entry, rule) for entry in entries)


def _larger(entry: Mapping[str, Any], rule: Refuted) -> bool:
    """Larger beyond doubt; an error that began at the noise floor has to be far above it."""
    if entry["share"] is None:
        return bool(entry["floor"] and entry["after"] > rule.above_floor * max(entry["floor"], entry["before"]))
    sure = entry["ci95"] is None or entry["ci95"][1] < 0
    return bool(sure and entry["after"] > rule.growth * entry["before"])


def unrefuted(
    session: Session, fitted: Sequence[Effect], read: Sequence[Effect], config: DiagnosisConfig
) -> tuple[list[Effect], list[Effect], PrintedErrors, list[str]]:
    """What held-out rollouts let stand of fitted effects and of those read off the logs; the errors; notes on the rest.

    What was fitted goes first: it stands or falls together.
    """
    fitted, read, notes = list(fitted), list(read), []
    errors = printed_errors(session, [*fitted, *read], config)
    while (fitted or read) and (horizons := refuted(session, errors, config.thresholds.report.refuted)):
        notes.append(_note(fitted or read, horizons))
        fitted, read = [], read if fitted else []
        errors = printed_errors(session, read, config)
    return fitted, read, errors, notes


def refuted(session: Session, errors: PrintedErrors, rule: Refuted) -> list[str]:
    """Horizons by which held-out rollouts refute a correction: those where it is worse, if it is better at none."""
    if not session.holdout or surely_better(errors.removed, rule):
        return []
    return surely_worse(errors.removed, rule)


def _note(effects: Sequence[Effect], horizons: Sequence[str]) -> str:
    names = ", ".join(f"{e.effect} on {', '.join(e.where) or 'the whole robot'}" for e in effects)
    after = ", ".join(horizons)
    return (
        f"withdrawn, for the error on held-out rollouts was larger after {after} s and smaller at no horizon: {names}"
    )
