"""Changes that keep a policy up on robots that nobody declared: single ones of the base policy's task."""

from pathlib import Path

import pandas as pd

from benchmarks.study.jobs import SURVIVORS, arm_of, base_of
from benchmarks.study.motions import Motions
from benchmarks.study.pages.table_1 import read_sealed
from benchmarks.study.pages.tables import (
    RATES,
    SPLITS,
    cell,
    difference,
    estimate,
    head,
    line,
    rate,
    read_trials,
    signed,
)
from benchmarks.study.settings import Study
from benchmarks.study.trying import SEALED_TRIALS, TRIALS

ARMS = {"base": "base policy", **SURVIVORS}


def robust_tables(out: Path, study: Study, motions: Motions) -> str:
    """All tables of the part `robust` as Markdown, of the arms that have been tried so far with every seed."""
    exact = _read(out, study, motions, TRIALS)
    parts = [_of_robot(exact, robot, f"{robot} robot") for robot in ("declared", "drawn")]
    sealed = _read(out, study, motions, SEALED_TRIALS)
    if sealed is not None:
        for robot in sorted(sealed["robot"].unique()):
            parts.append(_of_robot(sealed, robot, f"from readings: {robot}"))
        hidden = sealed[sealed["robot"] != "declared"]
        if not hidden.empty:
            parts.append(f"### from readings: all sealed robots\n\n{_arms(hidden)}\n{_pairs(hidden)}")
    return "\n".join(parts)


def _read(out: Path, study: Study, motions: Motions, file: str) -> pd.DataFrame | None:
    """A row for each arm, seed, robot and piece; None for sealed robots on which the base policy was not tried."""
    rows = []
    for arm in ARMS:
        names = [base_of(seed) if arm == "base" else arm_of(seed, arm) for seed in study.seeds]
        if not all((out / name / file).exists() for name in names):
            if arm == "base" and file == SEALED_TRIALS:
                return None
            if arm != "base":
                continue
        for seed, name in zip(study.seeds, names, strict=True):
            sealed = file == SEALED_TRIALS
            table = read_sealed(out / name, motions) if sealed else read_trials(out / name, motions)
            rows.append(table.assign(arm=arm, seed=seed))
    return pd.concat(rows, ignore_index=True)


def _of_robot(every: pd.DataFrame, robot: str, title: str) -> str:
    rows = every[every["robot"] == robot]
    return f"### {title}\n\n{_arms(rows)}\n{_pairs(rows)}"


def _arms(rows: pd.DataFrame) -> str:
    lines = head(["task", "motions", "n", *RATES.values(), "MPJPE [rad]", "MPKPE, own place [mm]"])
    for split, which in SPLITS.items():
        for arm, told in ARMS.items():
            own = rows[(rows["arm"] == arm) & (rows["split"] == split)]
            if own.empty:
                continue
            cells = [told, which, str(own["motion"].nunique()), *(cell(rate(own, column), 2) for column in RATES)]
            cells += [cell(estimate(own, "mpjpe_rad"), 3), cell(estimate(own, "mpkpe_local_mm"), 0)]
            lines.append(line(cells))
    return "\n".join(lines) + "\n"


def _pairs(rows: pd.DataFrame) -> str:
    lines = head(["less the base policy", "motions", *RATES.values(), "p, pelvis rule"])
    for split, which in SPLITS.items():
        own = rows[rows["split"] == split]
        for arm, told in SURVIVORS.items():
            if not (own["arm"] == arm).any():
                continue
            each = {column: difference(own, arm, "base", column) for column in RATES}
            cells = [told, which, *(signed(value) for value, _ in each.values())]
            lines.append(line([*cells, f"{each['success_upright'][1]:.3g}"]))
    return "\n".join(lines) + "\n"
