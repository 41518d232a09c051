"""Experts against one policy: what their trials say, paired by motion, with intervals over motions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.study.jobs import base_of, even_of, expert_of, one_of
from benchmarks.study.motions import Motions
from benchmarks.study.settings import Study
from benchmarks.study.trying import TRIALS
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import Estimate, mean_by_motion, motion_means, sign_flip_test, wilson

ARMS = {
    "base": "base policy",
    "one": "one policy, the experts' steps",
    "even": "the same, each cluster drawn as often",
    "random": "experts of random clusters",
    "experts": "experts by cluster",
}
PAIRS = (
    ("experts", "one"),
    ("experts", "even"),
    ("experts", "random"),
    ("one", "base"),
    ("even", "one"),
    ("experts", "base"),
)
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
        tables = {name: read_trials(out / expert_of(seed, name), motions) for name in names}
        single = {"base": base_of(seed), "one": one_of(seed)}
        if (out / even_of(seed) / TRIALS).exists():
            single["even"] = even_of(seed)
        tables |= {arm: read_trials(out / name, motions) for arm, name in single.items()}
        every += [table.assign(policy=name, seed=seed) for name, table in tables.items()]
        own += [tables[arm].assign(arm=arm, seed=seed) for arm in single]
        for arm, groups in clusters.items():
            parts = [tables[c][tables[c]["name"].map(groups) == c] for c in sorted(groups.unique())]
            own.append(pd.concat(parts).assign(arm=arm, seed=seed))
    return Arms(pd.concat(own, ignore_index=True), pd.concat(every, ignore_index=True))


def read_trials(folder: Path, motions: Motions) -> pd.DataFrame:
    """A policy's trials with the motion and cluster of each piece."""
    path = folder / TRIALS
    if not path.exists():
        raise BadInput(path, "the trials of every policy", "none", "Run `benchmarks.study experts` until it is done.")
    columns = motions.labels[["name", "motion", "cluster"]]
    return pd.read_csv(path).merge(columns, on="name", validate="many_to_one")


def rate(rows: pd.DataFrame, column: str) -> Estimate:
    """Mean over motions of a motion's share of successes, with Wilson's interval at the effective number of motions.

    That number is what the shares' variance between motions makes of the binomial one; where none or all succeed, it is
    the number of motions.
    """
    shares = motion_means(rows[column].to_numpy(float), rows["motion"].to_numpy())
    count, value = len(shares), float(shares.mean())
    variance = float(shares.var(ddof=1)) / count if count > 1 else 0.0
    effective = min(value * (1 - value) / variance, len(rows)) if variance > 0 else count
    return Estimate(value, *wilson(value * effective, effective), len(rows), count)


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


def experts_tables(out: Path, study: Study, motions: Motions) -> str:
    """All tables of the part `experts` as Markdown."""
    arms, parts = read_arms(out, study, motions), []
    for robot in ("declared", "drawn"):
        rows = arms.own[arms.own["robot"] == robot]
        parts.append(f"### {robot} robot\n\n{_arms_table(rows)}\n{_pairs_table(rows, study)}")
    parts.append(f"### By cluster, declared robot\n\n{_cluster_table(arms.own[arms.own['robot'] == 'declared'])}")
    parts.append(f"### Each expert on each cluster, trained motions, declared robot\n\n{_cross_table(arms, motions)}")
    return "\n".join(parts)


def _arms_table(rows: pd.DataFrame) -> str:
    titles = ["arm", "motions", "n", *RATES.values(), "MPJPE [rad]", "MPKPE [mm]"]
    lines = head(titles)
    for split, told in SPLITS.items():
        for arm, name in _present(rows).items():
            own = rows[(rows["arm"] == arm) & (rows["split"] == split)]
            cells = [name, told, str(own["motion"].nunique())]
            cells += [cell(rate(own, column), 2) for column in RATES]
            cells += [cell(estimate(own, "mpjpe_rad"), 3), cell(estimate(own, "mpkpe_mm"), 0)]
            lines.append(line(cells))
    return "\n".join(lines) + "\n"


def _pairs_table(rows: pd.DataFrame, study: Study) -> str:
    titles = [
        "success, difference",
        "motions",
        "all seeds",
        "p",
        *(f"seed {seed}" for seed in study.seeds),
        "pelvis rule",
    ]
    lines = head(titles)
    for split, told in SPLITS.items():
        own = rows[rows["split"] == split]
        for first, second in PAIRS:
            if not {first, second} <= set(_present(rows)):
                continue
            value, p = difference(own, first, second)
            each = [difference(own[own["seed"] == seed], first, second)[0].value for seed in study.seeds]
            other, _ = difference(own, first, second, "success_upright")
            cells = [f"{ARMS[first]} less {ARMS[second]}", told, signed(value), f"{p:.3g}"]
            lines.append(line([*cells, *(f"{one:+.2f}" for one in each), signed(other)]))
    return "\n".join(lines) + "\n"


def _cluster_table(rows: pd.DataFrame) -> str:
    titles = ["cluster", "motions", "n", *_present(rows).values(), "experts less one"]
    lines = head(titles)
    for cluster in sorted(rows["cluster"].unique()):
        for split, told in SPLITS.items():
            own = rows[(rows["cluster"] == cluster) & (rows["split"] == split)]
            if own.empty:
                continue
            cells = [cluster, told, str(own["motion"].nunique())]
            cells += [cell(rate(own[own["arm"] == arm], "success"), 2) for arm in _present(rows)]
            lines.append(line([*cells, signed(difference(own, "experts", "one")[0])]))
    return "\n".join(lines) + "\n"


def _cross_table(arms: Arms, motions: Motions) -> str:
    rows = arms.every[(arms.every["robot"] == "declared") & (arms.every["split"] == "train")]
    lines = head(["policy", *motions.clusters])
    for policy in ["base", "one", *motions.clusters]:
        own = rows[rows["policy"] == policy]
        cells = [cell(rate(own[own["cluster"] == cluster], "success"), 2) for cluster in motions.clusters]
        lines.append(line([policy, *cells]))
    return "\n".join(lines) + "\n"


def _present(rows: pd.DataFrame) -> dict[str, str]:
    """The arms that were tried, with their names; a run of before an arm was thought of lacks it."""
    return {arm: name for arm, name in ARMS.items() if (rows["arm"] == arm).any()}


def methods_table(rows: pd.DataFrame, names: Mapping[str, str], title: str) -> str:
    """A row for each arm that was tried and split: success by three rules, and errors until the loss.

    Args:
        rows: trials, the arm of each in `arm`.
        names: arm -> its name in the table, in order.
        title: head of the first column.
    """
    lines = head([title, "motions", "n", *RATES.values(), "MPJPE [rad]", "MPKPE [mm]", "MPKPE, own place [mm]"])
    for split, which in SPLITS.items():
        for arm, told in names.items():
            own = rows[(rows["arm"] == arm) & (rows["split"] == split)]
            if own.empty:
                continue
            cells = [told, which, str(own["motion"].nunique()), *(cell(rate(own, column), 2) for column in RATES)]
            cells += [cell(estimate(own, "mpjpe_rad"), 3)]
            cells += [cell(estimate(own, column), 0) for column in ("mpkpe_mm", "mpkpe_local_mm")]
            lines.append(line(cells))
    return "\n".join(lines) + "\n"


def head(cells: Sequence[str]) -> list[str]:
    """The two first lines of a Markdown table."""
    return [line(cells), "|" + "---|" * len(cells)]


def line(cells: Sequence[str]) -> str:
    """A row of a Markdown table."""
    return "| " + " | ".join(cells) + " |"


def cell(value: Estimate, digits: int) -> str:
    """A value with its interval."""
    if not np.isfinite(value.value):
        return "-"
    span = f" [{value.low:.{digits}f}, {value.high:.{digits}f}]" if np.isfinite(value.low) else ""
    return f"{value.value:.{digits}f}{span}"


def signed(value: Estimate) -> str:
    """A difference with its interval."""
    return f"{value.value:+.3f} [{value.low:+.3f}, {value.high:+.3f}]"


def relative(change: dict[str, float]) -> str:
    """A relative change, an entry of `learning.delta.Gain.change`, with its interval."""
    return f"{change['relative']:+.3f} [{change['low']:+.3f}, {change['high']:+.3f}]"


def motions_of(table: pd.DataFrame, by: str) -> list[str]:
    """The motion of each rollout of a table of errors, in the order of the rollouts' names."""
    (_, one), *_ = table.groupby([by, "horizon"])
    return one.sort_values("rollout")["motion"].tolist()
