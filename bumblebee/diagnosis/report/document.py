"""The contract's document, from what a diagnosis found."""

from collections.abc import Sequence
from typing import Any

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.discrepancy import Discovery
from bumblebee.diagnosis.prepare import Material
from bumblebee.diagnosis.report.discrepancy_entries import NOT_TESTED, structure_table, unexplained
from bumblebee.diagnosis.report.notes import LONE, factor_notes, latency_notes, unexplained_error
from bumblebee.diagnosis.report.prediction_error import error_block, floor_block, horizon_whiteners, horizon_windows
from bumblebee.diagnosis.residuals import NAMES
from bumblebee.diagnosis.selection import Refined, Search, detectable
from bumblebee.diagnosis.simulation import joint_units, mixed_notes, vary
from bumblebee.sim.effects import Effect

_STILL = "the joint moves no more than its sensor's noise"


def document(
    material: Material,
    config: DiagnosisConfig,
    found: Search,
    last: Refined,
    beyond: Discovery | None,
    effects: Sequence[Effect],
    entries: Sequence[dict[str, Any]],
    notes: Sequence[str],
) -> dict[str, Any]:
    """Which rollouts took which part, `entries` of the effects, the error with them, what is left and what to know."""
    session = material.session
    driven = _driven(session)
    told = (
        {"schema": 1, "train": session.ids(session.train)}
        | {"holdout": session.ids(session.holdout), "accept": session.ids(session.accept)}
        | {"effects": list(entries), "unexplained": NOT_TESTED if beyond is None else unexplained(beyond)}
        | ({} if beyond is None else {"structure": structure_table(beyond)})
        | {
            "units": joint_units(session.plant),
            "error": _errors(session, effects, config),
            "unidentifiable": [{"where": [name], "why": _STILL} for name in material.still],
            "smallest_detectable": detectable(found),
            "set_aside": session.set_aside,
            "notes": [
                *session.notes,
                *mixed_notes(session.plant),
                *notes,
                *latency_notes(entries, driven),
                *factor_notes(entries, driven),
            ],
            "settings": _settings(material, config, found.bound, last),
        }
    )
    lone = [] if session.holdout else [LONE]
    return told | {"warnings": [*session.warnings, *lone, *unexplained_error(told)]}


def _settings(material: Material, config: DiagnosisConfig, bound: float, last: Refined) -> dict[str, Any]:
    """What the diagnosis was made with."""
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


def _errors(session: Session, effects: Sequence[Effect], config: DiagnosisConfig) -> dict[str, Any]:
    ids = session.holdout or session.train
    windows = horizon_windows(session.plant, session.layout, session.rollouts, ids, config.report_windows)
    before, after = vary(session.plant, []), vary(session.plant, effects)
    common = (session.plant, session.layout, windows)
    whiteners = horizon_whiteners(*common, after, session.sigma, session.steps[1], config.seed)
    fine = session.steps[0]
    return {
        "before": error_block(*common, whiteners, before, fine, config.seed),
        "after": error_block(*common, whiteners, after, fine, config.seed),
        "floor": floor_block(*common, whiteners, session.sigma, config.seed),
    }
