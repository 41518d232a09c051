"""Experts against one policy: what their trials say, paired by motion, with intervals over motions."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.study.jobs import base_of, expert_of, one_of
from benchmarks.study.motions import Motions
from benchmarks.study.settings import Study
from benchmarks.study.trying import TRIALS
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import Estimate, mean_by_motion, motion_means, sign_flip_test

ARMS = {
    "base": "base policy",
    "one": "one policy, the experts' steps",
    "random": "experts of random clusters",
    "experts": "experts by cluster",
}
PAIRS = (("experts", "one"), ("experts", "random"), ("one", "base"), ("experts", "base"))
RATES = {"success": "success", "success_local": "own place", "success_upright": "pelvis rule"}
SPLITS = {"train": "trained", "test": "held out"}


@dataclass(frozen=True)
class Arms:
    """All trials of a study, one row for each arm, seed, robot and piece.

    `own`: the arms' rows. `every`: every policy's trials on every piece, with its name in `policy` and its seed.
    """

    own: pd.DataFrame
    every: pd.DataFrame


def read_arms(out: Path, study: Study, motions: Motions) -> Arms:
    """The trials of a finished run.

    Raises:
        BadInput: if a policy has not been tried.
    """
    labels = motions.labels.set_index("name")
    own, every = [], []
    for seed in study.seeds:
        clusters = {"experts": labels["cluster"], "random": motions.random_clusters(seed)}
        names = {name for groups in clusters.values() for name in groups.unique()}
        tables = {name: _trials(out / expert_of(seed, name), motions) for name in names}
        tables |= {"base": _trials(out / base_of(seed), motions), "one": _trials(out / one_of(seed), motions)}
        every += [table.assign(policy=name, seed=seed) for name, table in tables.items()]
        own += [tables[arm].assign(arm=arm, seed=seed) for arm in ("base", "one")]
        for arm, groups in clusters.items():
            parts = [tables[c][tables[c]["name"].map(groups) == c] for c in sorted(groups.unique())]
            own.append(pd.concat(parts).assign(arm=arm, seed=seed))
    return Arms(pd.concat(own, ignore_index=True), pd.concat(every, ignore_index=True))


def _trials(folder: Path, motions: Motions) -> pd.DataFrame:
    path = folder / TRIALS
    if not path.exists():
        raise BadInput(path, "the trials of every policy", "none", "Run `benchmarks.study experts` until it is done.")
    columns = motions.labels[["name", "motion", "cluster"]]
    return pd.read_csv(path).merge(columns, on="name", validate="many_to_one")


def estimate(rows: pd.DataFrame, column: str) -> Estimate:
    """Mean over motions of a column, its pieces and seeds being one motion's."""
    return mean_by_motion(rows[column].to_numpy(float), rows["motion"].to_numpy())


def difference(rows: pd.DataFrame, first: str, second: str, column: str = "success") -> tuple[Estimate, float]:
    """First arm less second, paired by piece, seed and robot, with the p-value of sign flips over motions."""
    keys = ["seed", "robot", "name"]
    pair = [rows[rows["arm"] == arm].set_index(keys)[[column, "motion"]].sort_index() for arm in (first, second)]
    away = pair[0][column].astype(float) - pair[1][column].astype(float)
    motion = pair[0]["motion"].to_numpy()
    return mean_by_motion(away.to_numpy(), motion), sign_flip_test(motion_means(away.to_numpy(), motion))


def experts_tables(arms: Arms, study: Study, motions: Motions) -> str:
    """All tables of the first part as Markdown."""
    parts = []
    for robot in ("declared", "drawn"):
        rows = arms.own[arms.own["robot"] == robot]
        parts.append(f"### {robot} robot\n\n{_arms_table(rows)}\n{_pairs_table(rows, study)}")
    parts.append(f"### By cluster, declared robot\n\n{_cluster_table(arms.own[arms.own['robot'] == 'declared'])}")
    parts.append(f"### Each expert on each cluster, trained motions, declared robot\n\n{_cross_table(arms, motions)}")
    return "\n".join(parts)


def _arms_table(rows: pd.DataFrame) -> str:
    head = ["arm", "motions", "n", *RATES.values(), "MPJPE [rad]", "MPKPE [mm]"]
    lines = _head(head)
    for split, told in SPLITS.items():
        for arm, name in ARMS.items():
            own = rows[(rows["arm"] == arm) & (rows["split"] == split)]
            cells = [name, told, str(own["motion"].nunique())]
            cells += [_cell(estimate(own, column), 2) for column in RATES]
            cells += [_cell(estimate(own, "mpjpe_rad"), 3), _cell(estimate(own, "mpkpe_mm"), 0)]
            lines.append(_line(cells))
    return "\n".join(lines) + "\n"


def _pairs_table(rows: pd.DataFrame, study: Study) -> str:
    head = [
        "success, difference",
        "motions",
        "all seeds",
        "p",
        *(f"seed {seed}" for seed in study.seeds),
        "pelvis rule",
    ]
    lines = _head(head)
    for split, told in SPLITS.items():
        own = rows[rows["split"] == split]
        for first, second in PAIRS:
            value, p = difference(own, first, second)
            each = [difference(own[own["seed"] == seed], first, second)[0].value for seed in study.seeds]
            other, _ = difference(own, first, second, "success_upright")
            cells = [f"{ARMS[first]} less {ARMS[second]}", told, _signed(value), f"{p:.3g}"]
            lines.append(_line([*cells, *(f"{one:+.2f}" for one in each), _signed(other)]))
    return "\n".join(lines) + "\n"


def _cluster_table(rows: pd.DataFrame) -> str:
    head = ["cluster", "motions", "n", *ARMS.values(), "experts less one"]
    lines = _head(head)
    for cluster in sorted(rows["cluster"].unique()):
        for split, told in SPLITS.items():
            own = rows[(rows["cluster"] == cluster) & (rows["split"] == split)]
            if own.empty:
                continue
            cells = [cluster, told, str(own["motion"].nunique())]
            cells += [_cell(estimate(own[own["arm"] == arm], "success"), 2) for arm in ARMS]
            lines.append(_line([*cells, _signed(difference(own, "experts", "one")[0])]))
    return "\n".join(lines) + "\n"


def _cross_table(arms: Arms, motions: Motions) -> str:
    rows = arms.every[(arms.every["robot"] == "declared") & (arms.every["split"] == "train")]
    lines = _head(["policy", *motions.clusters])
    for policy in ["base", "one", *motions.clusters]:
        own = rows[rows["policy"] == policy]
        cells = [_cell(estimate(own[own["cluster"] == cluster], "success"), 2) for cluster in motions.clusters]
        lines.append(_line([policy, *cells]))
    return "\n".join(lines) + "\n"


def _head(cells: Sequence[str]) -> list[str]:
    return [_line(cells), "|" + "---|" * len(cells)]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _cell(value: Estimate, digits: int) -> str:
    if not np.isfinite(value.value):
        return "-"
    span = f" [{value.low:.{digits}f}, {value.high:.{digits}f}]" if np.isfinite(value.low) else ""
    return f"{value.value:.{digits}f}{span}"


def _signed(value: Estimate) -> str:
    return f"{value.value:+.3f} [{value.low:+.3f}, {value.high:+.3f}]"
