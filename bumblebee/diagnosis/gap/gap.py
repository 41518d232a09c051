"""The gap report: where a model errs before anything is fitted, by horizon, joint, motion, and in torque."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import still_joints
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import JUDGED_TWICE, Session
from bumblebee.diagnosis.gap.missing_torque import MissingTorque, missing_torque
from bumblebee.diagnosis.gap.reported_torque import reported_torque
from bumblebee.diagnosis.report import (
    ALONE,
    HorizonWindows,
    error_block,
    examples,
    floor_block,
    horizon_whiteners,
    horizon_windows,
)
from bumblebee.diagnosis.simulation import Windows, joint_units, members, mixed_notes, residuals, vary
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.errors import BadInput


@dataclass(frozen=True, eq=False)
class Gap:
    """The report's numbers, and what its pictures are drawn from."""

    document: dict[str, Any]
    examples: list[dict[str, Any]]
    torque: MissingTorque | None
    """None where no stretch of the logs was long enough to test."""
    thresholds: Thresholds = field(default_factory=Thresholds)
    """Thresholds that it was made with."""


def gap(
    session: Session,
    budget: int = 120,
    config: DiagnosisConfig | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Gap:
    """Compare the declared model of `session` with all its rollouts; nothing is fitted.

    Args:
        session: the declared model and all rollouts.
        budget: windows for each horizon of the errors.
        config: of the diagnosis whose tests say what the model lacks.
        say: is told of each step.
    """
    config = config or DiagnosisConfig()
    rules = config.thresholds
    cuts = horizon_windows(session, list(range(len(session.rollouts))), budget, rules.report.prediction_error)
    still = still_joints(session.plant, session.rollouts, session.sigma)
    torque, untested = _tested(session, config, say)
    units = joint_units(session.plant)
    document = {
        **_heading(session, units),
        **_errors(session, cuts, config.seed),
        "missing_torque": torque.entries(units, rules.gap.naming) if torque else {},
        "reported_torque": reported_torque(session.plant, session.rollouts, rules.gap.reported_torque),
        "motions": _by_motion(session, cuts.windows),
        "unidentifiable": [
            {"where": [name], "why": "the joint is not excited: it moves no more than its sensor's noise"}
            for name in still
        ],
        "warnings": [*session.warnings, *([] if session.accept else [ALONE])],
        "notes": [*(n for n in session.notes if n != JUDGED_TWICE), *mixed_notes(session.plant), *untested],
        "set_aside": session.set_aside,
        "noise": dict(zip(session.layout.labels(session.plant.joints), session.sigma.tolist(), strict=True)),
    }
    return Gap(document, examples(session, rule=rules.report.example_windows), torque, rules)


def _tested(
    session: Session, config: DiagnosisConfig, say: Callable[[str], None]
) -> tuple[MissingTorque | None, list[str]]:
    """Missing torque of the declared model; where no window can be cut, None and a note why."""
    try:
        return missing_torque(session, config, say), []
    except BadInput as error:
        return None, [f"missing torques could not be tested: {error}"]


def _heading(session: Session, units: dict[str, dict[str, str]]) -> dict[str, Any]:
    """Heading: what was compared."""
    return {
        "schema": 1,
        "rollouts": session.ids(range(len(session.rollouts))),
        "seconds": float(sum(r.time[-1] - r.time[0] for r in session.rollouts)),
        "commands": "torques" if session.plant.torque_input else "position targets",
        "units": units,
    }


def _errors(session: Session, cuts: HorizonWindows, seed: int) -> dict[str, Any]:
    """Errors of the declared model, and what sensor noise alone leaves."""
    model = vary(session.plant, [])
    whiteners = horizon_whiteners(cuts, model, session.sigma, session.steps[1], seed)
    return {
        "error": error_block(cuts, whiteners, model, session.steps[0], seed),
        "floor": floor_block(cuts, whiteners, session.sigma, seed),
    }


def _by_motion(session: Session, windows: dict[str, Windows]) -> list[dict[str, Any]]:
    """Joint error after 0.2 s by motion and cluster, worst first."""
    name = "0.2" if "0.2" in windows else next(iter(windows), None)
    if name is None:
        return []
    part = windows[name]
    left = residuals(session.plant, session.layout, part, [vary(session.plant, [])], session.steps[0])[0, :, -1]
    squares = left[:, session.layout.slices["joint_pos"]] ** 2
    kinds = members(session.plant)
    groups: dict[tuple[str, str], list[np.ndarray]] = {}
    for i, values in zip(part.rollout, squares, strict=True):
        meta = session.rollouts[i].meta
        key = str(meta.get("cluster") or ""), str(meta.get("motion") or session.rollouts[i].rollout_id)
        groups.setdefault(key, []).append(values)
    found = []
    for (cluster, motion), windows_of in groups.items():
        entry = {"cluster": cluster, "motion": motion, "horizon": name, "windows": len(windows_of)}
        entry |= {"joint_pos_rmse": _rms(windows_of, slice(None))}
        entry |= {"by_kind": {kind: _rms(windows_of, columns) for kind, columns in kinds.items()}}
        found.append(entry)
    return sorted(found, key=lambda row: -(row["joint_pos_rmse"] or np.inf))


def _rms(squares: Sequence[np.ndarray], columns: list[int] | slice) -> float | None:
    """Root mean square over the windows that stayed finite; None where none did."""
    good = [value for row in squares if np.isfinite(value := float(row[columns].mean()))]
    return float(np.sqrt(np.mean(good))) if good else None
