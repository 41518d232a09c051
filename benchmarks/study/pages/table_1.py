"""The paper's table 1 with our numbers: its method, its controls and other groups' methods, at equal control steps."""

from pathlib import Path

import pandas as pd

from benchmarks.study.jobs import MORE_GENERALISTS, OTHERS, arm_of, teacher_of
from benchmarks.study.motions import Motions
from benchmarks.study.pages.tables import RATES, SPLITS, difference, head, line, methods_table, read_trials, signed
from benchmarks.study.settings import Study
from benchmarks.study.trying import SEALED_TRIALS, TRIALS
from bumblebee.errors import BadInput

OURS = "transformer"
STUDENTS = {OURS: "BumbleBee: transformer, of the experts by cluster", **MORE_GENERALISTS, **OTHERS}
TEACHERS = {name: f"{told}'s teacher, which sees the simulator" for name, told in OTHERS.items()}
NAMES = STUDENTS | {f"{name}-teacher": told for name, told in TEACHERS.items()}


def table_1_tables(out: Path, study: Study, motions: Motions) -> str:
    """All tables of the part `table-1` as Markdown, of the methods that have been tried so far.

    Those of the sealed robots if the paper's method was tried on them.
    """
    every = _read(out, study, motions, sealed=False)
    parts = [_of_robot(every, robot) for robot in ("declared", "drawn")]
    if all((out / arm_of(seed, OURS) / SEALED_TRIALS).exists() for seed in study.seeds):
        sealed = _read(out, study, motions, sealed=True)
        robots = sorted(sealed["robot"].unique())
        parts += [_of_robot(sealed, robot, "from readings: ") for robot in robots]
        hidden = sealed[sealed["robot"] != "declared"]
        if not hidden.empty:
            parts.append(f"### from readings: all sealed robots\n\n{_pairs(hidden)}")
    return "\n".join(parts)


def _read(out: Path, study: Study, motions: Motions, sealed: bool) -> pd.DataFrame:
    """A row for each arm, seed, robot and piece, of the methods that were tried with every seed.

    Teachers are tried on the declared and drawn robots only.
    """
    rows, file = [], SEALED_TRIALS if sealed else TRIALS
    named = {arm: [arm_of(seed, arm) for seed in study.seeds] for arm in STUDENTS}
    if not sealed:
        named |= {f"{method}-teacher": [teacher_of(seed, method) for seed in study.seeds] for method in OTHERS}
    for arm, names in named.items():
        if arm == OURS or all((out / name / file).exists() for name in names):
            for seed, name in zip(study.seeds, names, strict=True):
                table = read_sealed(out / name, motions) if sealed else read_trials(out / name, motions)
                rows.append(table.assign(arm=arm, seed=seed))
    return pd.concat(rows, ignore_index=True)


def read_sealed(folder: Path, motions: Motions) -> pd.DataFrame:
    """A policy's trials on sealed robots with the motion and cluster of each piece.

    Raises:
        BadInput: for rows without a robot's hash.
    """
    path, columns = folder / SEALED_TRIALS, motions.labels[["name", "motion", "cluster"]]
    table = pd.read_csv(path)
    if table["sealed"].isna().any():
        raise BadInput(path, "trials on sealed robots", "rows without a robot's hash", "Try the policy again.")
    return table.merge(columns, on="name", validate="many_to_one")


def _of_robot(every: pd.DataFrame, robot: str, told: str = "") -> str:
    rows = every[every["robot"] == robot]
    return f"### {told}{robot} robot\n\n{methods_table(rows, NAMES, 'method')}\n{_pairs(rows)}"


def _pairs(rows: pd.DataFrame) -> str:
    lines = head(["BumbleBee less", "motions", *RATES.values(), "p, own place"])
    for split, which in SPLITS.items():
        own = rows[rows["split"] == split]
        for arm, told in STUDENTS.items():
            if arm == OURS or not (own["arm"] == arm).any():
                continue
            each = {column: difference(own, OURS, arm, column) for column in RATES}
            cells = [told, which, *(signed(value) for value, _ in each.values())]
            lines.append(line([*cells, f"{each['success_local'][1]:.3g}"]))
    return "\n".join(lines) + "\n"
