"""The contract's document, from what a diagnosis found."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session, varied
from bumblebee.diagnosis.discrepancy import Discovery
from bumblebee.diagnosis.prepare import Material
from bumblebee.diagnosis.report.discrepancy_entries import NOT_TESTED, structure_table, unexplained
from bumblebee.diagnosis.report.notes import LONE, factor_notes, latency_notes, mount_notes, unexplained_error
from bumblebee.diagnosis.report.prediction_error import (
    block_of,
    floor_block,
    horizon_whiteners,
    horizon_windows,
    window_residuals,
)
from bumblebee.diagnosis.report.removed_error import Ends
from bumblebee.diagnosis.report.what_matters import bound_warnings, what_matters
from bumblebee.diagnosis.residuals import NAMES
from bumblebee.diagnosis.selection import Refined, Search, detectable
from bumblebee.diagnosis.simulation import joint_units, mixed_notes, vary
from bumblebee.diagnosis.thresholds.report import Verdicts
from bumblebee.sim.effects import Effect

_STILL = "the joint is not excited: it moves no more than its sensor's noise"


@dataclass(frozen=True)
class Findings:
    """Entries of the document on effects."""

    effects: Sequence[Effect]
    entries: Sequence[dict[str, Any]]
    """Entries of the effects, as the contract has them."""
    notes: Sequence[str]


def document(
    material: Material,
    config: DiagnosisConfig,
    found: Search,
    last: Refined,
    beyond: Discovery | None,
    findings: Findings,
) -> dict[str, Any]:
    """Which rollouts took which part, the effects, the error with them, what is left and what to know."""
    session, rules = material.session, config.thresholds.report
    errors, ends = _errors(session, findings.effects, config)
    told = (
        {"schema": 1, "train": session.ids(session.train)}
        | {"holdout": session.ids(session.holdout), "accept": session.ids(session.accept)}
        | _recorded_under(session)
        | {"effects": list(findings.entries)}
        | {"unexplained": NOT_TESTED if beyond is None else unexplained(beyond, rules)}
        | ({} if beyond is None else {"structure": structure_table(beyond, rules.measured_curve)})
        | {
            "units": joint_units(session.plant),
            "error": errors,
            "unidentifiable": [{"where": [name], "why": _STILL} for name in material.still],
            "smallest_detectable": detectable(found),
            "set_aside": session.set_aside,
            "notes": _notes(session, findings, rules.verdicts),
            "settings": _settings(material, config, found.bound, last),
        }
    )
    lone = [] if session.holdout else [LONE]
    told["summary"] = what_matters(told, ends, rules.matters, config.seed)
    return told | {
        "warnings": [
            *session.warnings,
            *lone,
            *bound_warnings(findings.entries),
            *unexplained_error(told, rules.verdicts),
        ]
    }


def _recorded_under(session: Session) -> dict[str, Any]:
    """By what rollouts were held out, if by a condition; and which conditions were not the same for all."""
    entry = {} if session.held_out is None else {"split": session.held_out.entry()}
    conditions = varied(session.rollouts)
    return entry | ({"conditions": conditions} if conditions else {})


def _notes(session: Session, findings: Findings, rule: Verdicts) -> list[str]:
    """Notes beside the effects."""
    driven = _driven(session)
    return [
        *session.notes,
        *mixed_notes(session.plant),
        *findings.notes,
        *session.plant.failures.notes(rule.failures),
        *latency_notes(findings.entries, driven, rule),
        *factor_notes(findings.entries, driven),
        *mount_notes(findings.entries, session.plant.floating),
    ]


def _settings(material: Material, config: DiagnosisConfig, bound: float, last: Refined) -> dict[str, Any]:
    """Settings that the diagnosis was made with."""
    session = material.session
    return {
        "timestep": session.steps[0],
        "windows": len(material.problem.windows),
        "horizon": config.horizon,
        "seed": config.seed,
        "candidates": len(material.candidates),
        "bound": bound,
        "numerics": dict(zip(NAMES, last.fit.nuisance.tolist(), strict=False)),
        "noise": dict(zip(session.layout.labels(session.plant.joints), session.sigma.tolist(), strict=True)),
    }


def _driven(session: Session) -> list[str]:
    """Names of the joints with an actuator."""
    return [name for name, a in zip(session.plant.joints, session.plant.actuator, strict=True) if a >= 0]


def _errors(session: Session, effects: Sequence[Effect], config: DiagnosisConfig) -> tuple[dict[str, Any], Ends]:
    """The contract's block: of the declared and of the corrected model, and what sensor noise alone leaves.

    Beside it the residuals of both.
    """
    ids = session.holdout or session.train
    cuts = horizon_windows(session, ids, config.report_windows, config.thresholds.report.prediction_error)
    before, after = vary(session.plant, []), vary(session.plant, effects)
    whiteners = horizon_whiteners(cuts, after, session.sigma, session.steps[1], config.seed)
    fine = session.steps[0]
    ends = Ends(cuts, window_residuals(cuts, before, fine), window_residuals(cuts, after, fine))
    return {
        "before": block_of(cuts, whiteners, ends.before, config.seed),
        "after": block_of(cuts, whiteners, ends.after, config.seed),
        "floor": floor_block(cuts, whiteners, session.sigma, config.seed),
    }, ends
