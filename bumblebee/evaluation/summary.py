"""From episodes to a summary: rates and errors with intervals by group, and paired comparisons by motion."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.evaluation.intervals import (
    bootstrap_mean,
    mcnemar_test,
    mean_by_motion,
    motion_means,
    sign_flip_test,
    success_rate,
)

COLUMNS = (
    "policy", "kind", "round", "cluster", "motion", "family", "split", "engine", "seed",
    "success", "mpjpe_rad", "mpkpe_mm", "frames", "end_reason",
)  # fmt: skip
ALL = "all"
TOGETHER = {
    "expert": "experts-r{}",
    "compensated": "experts-r{}-compensated",
    "control-declared": "control-declared-r{}",
    "control-delta": "control-delta-r{}",
}
"""Kind of policy -> name of all clusters' policies of a round together, each on its own cluster's motions."""


def results(episodes: pd.DataFrame) -> list[dict[str, Any]]:
    """One entry for each policy, engine, split and group.

    `policy` is also "experts-r<N>": every motion by its own cluster's expert of round N (`TOGETHER`). `group_by` is
    "all", "family" or "cluster" (of the motion). Errors are means over motions, over all episodes up to termination
    and, apart, over successful ones (`*_successful`), since errors of failures stop at the failure and so flatter it.
    """
    return [
        {
            "policy": policy,
            "kind": str(rows["kind"].iloc[0]),
            "round": _int(rows["round"].iloc[0]),
            "engine": engine,
            "split": split,
            "group_by": by,
            "group": group,
            **numbers(rows),
        }
        for policy, own in policies(episodes)
        for engine, some in own.groupby("engine", sort=True)
        for split, part in _with_all(some, "split")
        for by, group, rows in _groups(part)
    ]


def numbers(rows: pd.DataFrame) -> dict[str, Any]:
    """n, success, mpjpe_rad, mpkpe_mm (and `*_successful`), each value with its 95 % interval, and the endings."""
    motions, good = rows["motion"].to_numpy(), rows["success"].to_numpy(dtype=bool)
    entry: dict[str, Any] = {"n": len(rows), "success": success_rate(good, motions).as_dict()}
    for metric in ("mpjpe_rad", "mpkpe_mm"):
        values = rows[metric].to_numpy(dtype=float)
        entry[metric] = mean_by_motion(values, motions).as_dict()
        entry[f"{metric}_successful"] = mean_by_motion(np.where(good, values, np.nan), motions).as_dict()
    entry["end_reasons"] = {
        str(key): int(value) for key, value in rows["end_reason"].value_counts().sort_index().items()
    }
    return entry


def policies(episodes: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Each policy's episodes, then those of all experts of a round together under the names of `TOGETHER`."""
    for name in episodes["policy"].drop_duplicates():
        yield str(name), episodes[episodes["policy"] == name]
    for kind, name in TOGETHER.items():
        for number, rows in episodes[episodes["kind"] == kind].groupby("round", sort=True):
            yield name.format(int(number)), rows


def compare(episodes: pd.DataFrame, first: str, second: str, engine: str, split: str) -> dict[str, Any] | None:
    """Second policy against first on the episodes (motion, seed) that both have; None where they share none.

    `success` is the difference of rates over motions with a bootstrap interval and the sign-flip p-value over motions;
    `mcnemar_p` pairs single episodes and is given only where there is one seed. Errors are compared over episodes in
    which both succeeded.
    """
    table = dict(policies(episodes))
    if first not in table or second not in table:
        return None
    both = _paired(table[first], table[second], engine, split)
    if both.empty:
        return None
    gain = both["success_2"].astype(float) - both["success_1"].astype(float)
    means = motion_means(gain.to_numpy(), both["motion"].to_numpy())
    entry: dict[str, Any] = {
        "from": first,
        "to": second,
        "engine": engine,
        "split": split,
        "episodes": len(both),
        "motions": len(means),
        "success": _difference(means),
        "mcnemar_p": mcnemar_test(both["success_1"], both["success_2"]) if both["seed"].nunique() == 1 else None,
    }
    good = both[both["success_1"] & both["success_2"]]
    for metric in ("mpjpe_rad", "mpkpe_mm"):
        change = (good[f"{metric}_2"] - good[f"{metric}_1"]).to_numpy(dtype=float)
        entry[metric] = _difference(motion_means(change, good["motion"].to_numpy()))
    return entry


def comparisons(episodes: pd.DataFrame, pairs: list[tuple[str, str]]) -> list[dict[str, Any]]:
    """`compare` for each pair of policies, engine, and split ("all" among them)."""
    engines = sorted(episodes["engine"].unique())
    splits = [ALL, *sorted(episodes["split"].unique())]
    found = [compare(episodes, a, b, engine, split) for a, b in pairs for engine in engines for split in splits]
    return [entry for entry in found if entry is not None]


def same_files(files: Mapping[str, str], first: str, second: str) -> bool:
    """Whether two sides of a comparison are the same policy files, so that there is nothing to compare.

    A side "experts-r<N>" is every expert of round N (likewise the others of `TOGETHER`): it is the same as one policy
    where each of them is, and as another round where each cluster's two experts are. A cluster of which only one side
    has an expert is not compared, so it does not count; where none is left, or a policy is not known, the answer is no.

    Args:
        files: policy ("base", "expert-<cluster>-r<N>", ...) -> sha256 of its ONNX file.
        first: one side of the comparison.
        second: the other one.
    """
    one, other = _by_cluster(files, first), _by_cluster(files, second)
    if first in files:
        one = dict.fromkeys(other, files[first])
    if second in files:
        other = dict.fromkeys(one, files[second])
    shared = one.keys() & other.keys()
    return bool(shared) and all(one[cluster] == other[cluster] for cluster in shared)


def unchanged_pairs(files: Mapping[str, str], pairs: Sequence[tuple[str, str]]) -> set[tuple[str, str]]:
    """Those of the pairs whose two sides are the same policy files, see `same_files`."""
    return {pair for pair in pairs if same_files(files, *pair)}


def _by_cluster(files: Mapping[str, str], side: str) -> dict[str, str]:
    """Cluster -> file of the experts that "experts-r<N>" stands for; of a single policy, its file under no cluster."""
    if side in files:
        return {"": files[side]}
    member = _member(side)
    found = ((re.fullmatch(member, policy), file) for policy, file in files.items()) if member else ()
    return {match[1]: file for match, file in found if match}


def _member(side: str) -> str:
    """Pattern of the policies that a name of `TOGETHER` stands for, their cluster its group; "" for another name."""
    if match := re.fullmatch(r"experts-r(\d+)(-compensated)?", side):
        return rf"expert-(.+)-r{match[1]}{match[2] or ''}"
    match = re.fullmatch(r"(control-[a-z]+)-r(\d+)", side)
    return rf"{match[1]}-(.+)-r{match[2]}" if match else ""


def _paired(first: pd.DataFrame, second: pd.DataFrame, engine: str, split: str) -> pd.DataFrame:
    keys, values = ["motion", "seed"], ["success", "mpjpe_rad", "mpkpe_mm"]
    halves = []
    for rows in (first, second):
        some = rows[rows["engine"] == engine]
        halves.append((some if split == ALL else some[some["split"] == split])[keys + values])
    return halves[0].merge(halves[1], on=keys, suffixes=("_1", "_2"), validate="one_to_one")


def _difference(means: np.ndarray) -> dict[str, Any]:
    """Mean of paired differences by motion with interval and p-value; null where there are too few."""
    if len(means) == 0:
        return {"motions": 0, "value": None, "ci95": [None, None], "p": None, "test": "sign-flip over motions"}
    low, high = bootstrap_mean(means)
    ci95 = [low if np.isfinite(low) else None, high if np.isfinite(high) else None]
    return {
        "motions": len(means),
        "value": float(means.mean()),
        "ci95": ci95,
        "p": sign_flip_test(means),
        "test": "sign-flip over motions",
    }


def _with_all(rows: pd.DataFrame, column: str) -> Iterator[tuple[str, pd.DataFrame]]:
    yield ALL, rows
    for value, part in rows.groupby(column, sort=True):
        yield str(value), part


def _groups(rows: pd.DataFrame) -> Iterator[tuple[str, str, pd.DataFrame]]:
    yield ALL, ALL, rows
    for by in ("family", "cluster"):
        for value, part in rows.groupby(by, sort=True):
            yield by, str(value), part


def _int(value: object) -> int | None:
    return None if pd.isna(value) else int(value)  # type: ignore[call-overload]
