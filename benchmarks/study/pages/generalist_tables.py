"""Generalists against the experts that they were distilled from: success paired by motion, and the margin."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from benchmarks.study.jobs import DONE, GENERALISTS, arm_of, base_of, even_of, expert_of, one_of
from benchmarks.study.motions import Motions
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
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import Estimate

ARMS = {
    "base": "base policy",
    "experts": "experts, each on its cluster",
    "one": "one policy, the experts' steps",
    "even": "the same, each cluster drawn as often",
    **GENERALISTS,
}
PAIRS = (
    ("transformer", "experts"),
    ("mlp", "experts"),
    ("seeing", "experts"),
    ("transformer", "mlp"),
    ("transformer", "init"),
    ("transformer", "base"),
    ("seeing", "base"),
    ("seeing", "one"),
    ("seeing", "even"),
    ("even", "one"),
    ("experts", "even"),
)
"""First less second; where the second is `experts`, the margin is judged."""
VERDICT_BY = {"seeing": "success"}
"""Rate by which a generalist keeps its experts' success; own place for students, who know their place by odometry."""


def read_generalists(out: Path, study: Study, motions: Motions, arms: Sequence[str] = tuple(ARMS)) -> pd.DataFrame:
    """A row for each of the arms, seed, robot and piece.

    Raises:
        BadInput: if a policy has not been tried.
    """
    cluster, rows = motions.labels.set_index("name")["cluster"], []
    for seed in study.seeds:
        single = {"base": base_of(seed), "one": one_of(seed), "even": even_of(seed)}
        single |= {arm: arm_of(seed, arm) for arm in GENERALISTS}
        tried = {arm: name for arm, name in single.items() if arm in arms}
        rows += [read_trials(out / name, motions).assign(arm=arm, seed=seed) for arm, name in tried.items()]
        for own in motions.clusters if "experts" in arms else ():
            table = read_trials(out / expert_of(seed, own), motions)
            rows.append(table[table["name"].map(cluster) == own].assign(arm="experts", seed=seed))
    return pd.concat(rows, ignore_index=True)


def generalist_tables(out: Path, study: Study, motions: Motions, arms: Sequence[str] = tuple(ARMS)) -> str:
    """All tables of the part `generalist` as Markdown, or those of some arms.

    Raises:
        BadInput: if there is no such arm, or a policy has not been tried.
    """
    if unknown := sorted(set(arms) - set(ARMS)):
        raise BadInput("--arms", f"some of {', '.join(ARMS)}", ", ".join(unknown))
    told = {arm: name for arm, name in ARMS.items() if arm in arms}
    every, parts = read_generalists(out, study, motions, arms), [_kl_table(out, study.seeds, told)]
    for robot in ("declared", "drawn"):
        rows = every[every["robot"] == robot]
        parts.append(f"### {robot} robot\n\n{_arms_table(rows, told)}\n{_pairs_table(rows, study.distil.margin, told)}")
    own = every[every["robot"] == "declared"]
    parts.append(f"### By cluster, declared robot, own place\n\n{_cluster_table(own, told)}")
    return "\n".join(parts)


def verdict(change: Estimate, margin: float) -> str:
    """Whether a difference to the experts is within the margin that was stated beforehand."""
    if change.low > -margin:
        return "kept"
    return "lost" if change.high < -margin else "open"


def _kl_table(out: Path, seeds: Sequence[int], arms: Mapping[str, str]) -> str:
    lines = head(["generalist", *(f"KL at the end, seed {seed}" for seed in seeds)])
    for arm, told in ((arm, told) for arm, told in arms.items() if arm in GENERALISTS):
        ends = [json.loads((out / arm_of(seed, arm) / DONE).read_text())["kl"] for seed in seeds]
        lines.append(line([told, *(f"{end:.3f}" for end in ends)]))
    return "\n".join(lines) + "\n"


def _arms_table(rows: pd.DataFrame, arms: Mapping[str, str]) -> str:
    lines = head(["arm", "motions", "n", *RATES.values(), "MPJPE [rad]", "MPKPE [mm]"])
    for split, told in SPLITS.items():
        for arm, name in arms.items():
            own = rows[(rows["arm"] == arm) & (rows["split"] == split)]
            cells = [name, told, str(own["motion"].nunique())]
            cells += [cell(rate(own, column), 2) for column in RATES]
            lines.append(line([*cells, cell(estimate(own, "mpjpe_rad"), 3), cell(estimate(own, "mpkpe_mm"), 0)]))
    return "\n".join(lines) + "\n"


def _pairs_table(rows: pd.DataFrame, margin: float, arms: Mapping[str, str]) -> str:
    lines = head(["difference", "motions", *RATES.values(), "p, own place", f"within {margin:.2f} of the experts"])
    for split, told in SPLITS.items():
        own = rows[rows["split"] == split]
        for first, second in ((first, second) for first, second in PAIRS if first in arms and second in arms):
            each = {column: difference(own, first, second, column) for column in RATES}
            judged = each[VERDICT_BY.get(first, "success_local")][0]
            kept = verdict(judged, margin) if second == "experts" else ""
            cells = [f"{arms[first]} less {arms[second]}", told, *(signed(value) for value, _ in each.values())]
            lines.append(line([*cells, f"{each['success_local'][1]:.3g}", kept]))
    return "\n".join(lines) + "\n"


def _cluster_table(rows: pd.DataFrame, arms: Mapping[str, str]) -> str:
    lines = head(["cluster", "motions", "n", *arms.values()])
    for cluster in sorted(rows["cluster"].unique()):
        for split, told in SPLITS.items():
            own = rows[(rows["cluster"] == cluster) & (rows["split"] == split)]
            if own.empty:
                continue
            cells = [cluster, told, str(own["motion"].nunique())]
            lines.append(line([*cells, *(cell(rate(own[own["arm"] == arm], "success_local"), 2) for arm in arms)]))
    return "\n".join(lines) + "\n"
