"""Policies on whole motions and on pieces in MuJoCo C: by motion, and as a table with intervals.

    python -m benchmarks.baselines.trial FOLDER --motions motions.npz --out results/name

tries any policy of this repository alone; `benchmarks.baselines` does it for what it has trained.
"""

import argparse
import json
import multiprocessing
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import torch

from benchmarks.baselines.others.follow import follow
from benchmarks.motion_pack import read_pack, whole_motions
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.intervals import mean_by_motion, success_rate
from bumblebee.learning.policy import load_policy
from bumblebee.learning.rollout import Manner
from bumblebee.sim.sensors import load_model

PHYSICS_HZ = 200.0
REAL = "real"
TRIALS, RESULTS, TABLE = "trials.csv", "results.json", "table.md"
RATES = {"success": "success", "success_local": "success, own place", "success_upright": "pelvis rule"}
METRICS = {"mpjpe_rad": "MPJPE [rad]", "mpkpe_mm": "MPKPE [mm]", "mpkpe_local_mm": "MPKPE, own place [mm]"}


@dataclass(frozen=True)
class Tried:
    """A policy that is tried, and how it is run."""

    name: str
    folder: Path
    manner: Manner


def report(tried: Sequence[Tried], motions: Path, out: Path, jobs: int) -> pd.DataFrame:
    """Try all, write the table by motion, the results and the table with intervals; returns the first."""
    work = [(one, motions, part, jobs) for one in tried for part in range(jobs)]
    if jobs == 1:
        tables = [try_part(*each) for each in work]
    else:
        with multiprocessing.get_context("spawn").Pool(jobs) as pool:
            tables = pool.starmap(try_part, work)
    trials = pd.concat([table for table in tables if table is not None], ignore_index=True)
    trials.to_csv(out / TRIALS, index=False)
    results = summary(trials)
    (out / RESULTS).write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    text = table_of(results)
    (out / TABLE).write_text(text)
    print(text, flush=True)
    return trials


def try_part(one: Tried, motions: Path, part: int, parts: int) -> pd.DataFrame | None:
    """A share of the motions, whole and in pieces, in this process."""
    torch.set_num_threads(1)
    rows = read_pack(motions)
    kinds = {"whole": whole_motions(rows), "pieces": [row for row in rows if row.kept and row.group != "embedded"]}
    policy, tables = load_policy(one.folder), []
    for kind, every in kinds.items():
        own = sorted(every, key=lambda row: (row.clip.frames, row.clip.name))[part::parts]
        if own:
            table = follow(policy, one.manner, [row.clip for row in own], load_model(physics_hz=PHYSICS_HZ))
            tables.append(table.assign(policy=one.name, kind=kind, group=[row.group for row in own]))
    return pd.concat(tables, ignore_index=True) if tables else None


def summary(trials: pd.DataFrame) -> list[dict]:
    """An entry for each policy, kind, source (each group, and all real ones) and split, with intervals over motions."""
    real = trials[trials["group"] != "embedded"].assign(group=REAL)
    entries = []
    keys = ["policy", "kind", "group", "split"]
    for (policy, kind, group, split), rows in pd.concat([trials, real]).groupby(keys, sort=True):
        motions = rows["name"].str.replace(r"_p\d+$", "", regex=True).to_numpy()
        entry = {"policy": policy, "kind": kind, "group": group, "split": split, "n": len(rows)}
        for name in RATES:
            entry[name] = success_rate(rows[name].to_numpy(dtype=bool), motions).as_dict()
        for name in METRICS:
            values = rows[name].to_numpy(dtype=float)
            entry[name] = mean_by_motion(values, motions).as_dict()
            done = rows["success"].to_numpy(dtype=bool)
            entry[f"{name}_successful"] = mean_by_motion(values[done], motions[done]).as_dict()
        entries.append(entry)
    return entries


def table_of(results: Sequence[dict]) -> str:
    """The results as Markdown: rates and errors with 95 % intervals; errors until the loss, over all motions."""
    head = ["policy", "motions", "split", "n", *RATES.values(), *METRICS.values()]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for entry in results:
        cells = [entry["policy"], f"{entry['group']}, {entry['kind']}", entry["split"], str(entry["n"])]
        cells += [rate(entry[name]) for name in RATES]
        cells += [_number(entry[name], 3 if name == "mpjpe_rad" else 0) for name in METRICS]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def rate(estimate: dict) -> str:
    """A share with its interval."""
    low, high = estimate["ci95"]
    return f"{estimate['value']:.2f} [{low:.2f}, {high:.2f}]"


def _number(estimate: dict, digits: int) -> str:
    low, high = estimate["ci95"]
    if estimate["value"] is None:
        return "-"
    span = "" if low is None else f" [{low:.{digits}f}, {high:.{digits}f}]"
    return f"{estimate['value']:.{digits}f}{span}"


def main() -> None:
    """Try the policy in a folder as its shape says that it sees and acts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with policy.pt")
    parser.add_argument("--motions", type=Path, required=True, help="file of benchmarks.motion_pack")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    options = parser.parse_args()
    try:
        seen = load_policy(options.folder).shape.seen
        options.out.mkdir(parents=True, exist_ok=True)
        name = options.out.name
        report([Tried(name, options.folder, Manner(seen))], options.motions, options.out, options.jobs)
        (options.out / "settings.json").write_text(json.dumps({"method": name}) + "\n")
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
