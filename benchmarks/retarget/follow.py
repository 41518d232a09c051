"""Which set of the same motions can be followed: one policy each, trained the same minutes on its set and tried on it.

    python -m benchmarks.retarget.follow pack theirs:raw=asap_g1 ours=asap_smpl --out sets
    python -m benchmarks.baselines --method ours --motions sets/ours.npz --minutes 8 --out results/ours-0 --seed 0
    python -m benchmarks.retarget.follow compare ours=results/ours-0 theirs=results/theirs-0 --out follow

Only names that every set has are kept; all are learned from and all are tried, whole. A name that ends in `:raw` has
its folder read without our floor correction, one in `:lower` with the heights lowered alone. Several runs of one set
are seeds: `ours=results/ours-0,results/ours-1`.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.baselines.trial import TRIALS
from benchmarks.motion_pack import Packed, write_pack
from benchmarks.retarget.quality import method_of, read_set
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.intervals import mcnemar_test, success_rate
from bumblebee.motion.clip import Clip

WHOLE = "whole"
SEEDS_WIN = 0.5  # paired, a set follows a motion where more than this share of its runs do: of two, both


def common(sets: Mapping[str, Sequence[Clip]]) -> dict[str, list[Packed]]:
    """The motions whose name every set has, in the order of names, all to be learned from.

    Raises:
        BadInput: if there is none.
    """
    names = set.intersection(*({clip.name for clip in clips} for clips in sets.values()))
    if not names:
        raise BadInput(", ".join(sets), "sets with motions of the same names", "no name that all have")
    return {
        name: [
            Packed(name, True, replace(clip, split="train"))
            for clip in sorted(clips, key=lambda clip: clip.name)
            if clip.name in names
        ]
        for name, clips in sets.items()
    }


def trials_of(folders: Sequence[Path]) -> pd.DataFrame:
    """Success of whole motions (M, S): a row a motion, a column a run, a seed of the same set.

    Raises:
        BadInput: a run without trials, or with other motions than the first.
    """
    columns = {}
    for folder in folders:
        if not (folder / TRIALS).exists():
            raise BadInput(folder / TRIALS, "the trials of benchmarks.baselines", "no such file")
        table = pd.read_csv(folder / TRIALS)
        columns[str(folder)] = table[table["kind"] == WHOLE].set_index("name")["success"].astype(bool)
    joined = pd.DataFrame(columns)
    if joined.isna().any(axis=None):
        raise BadInput(str(folders[0]), "the same motions in all runs of a set", "others")
    return joined.astype(bool)


def compared(runs: Mapping[str, pd.DataFrame]) -> tuple[list[dict], list[dict]]:
    """An entry a set (share of motions followed), and one a pair of sets (which motions only one of them gives)."""
    alone = []
    for name, table in runs.items():
        motions = np.repeat(table.index.to_numpy(), table.shape[1])
        rate = success_rate(table.to_numpy().ravel(), motions).as_dict()
        alone.append({"set": name, "seeds": table.shape[1], "followed": table.sum().tolist(), **rate})
    pairs = []
    for first, second in combinations(runs, 2):
        names = runs[first].index.intersection(runs[second].index)
        a, b = (runs[name].loc[names].mean(axis=1).to_numpy() for name in (first, second))
        won, lost = a > SEEDS_WIN, b > SEEDS_WIN
        pair = {"first": first, "second": second, "n": len(names), "both": int((won & lost).sum())}
        pair |= {"only_first": names[won & ~lost].tolist(), "only_second": names[~won & lost].tolist()}
        pairs.append(pair | {"difference": float((a - b).mean()), "p": mcnemar_test(won, lost)})
    return alone, pairs


def markdown(alone: Sequence[dict], pairs: Sequence[dict]) -> str:
    """Both as tables."""
    lines = ["| set | motions | runs | followed, by run | share [95 %] |", "|---|---|---|---|---|"]
    for row in alone:
        low, high = row["ci95"]
        by_run = ", ".join(map(str, row["followed"]))
        share = f"{row['value']:.2f} [{low:.2f}, {high:.2f}]"
        lines.append(f"| {row['set']} | {row['motions']} | {row['seeds']} | {by_run} | {share} |")
    head = "| first, second | n | both | only first | only second | difference of shares | p (McNemar) |"
    lines += ["", head, "|---|---|---|---|---|---|---|"]
    for row in pairs:
        counts = f"{row['both']} | {len(row['only_first'])} | {len(row['only_second'])}"
        lines.append(
            f"| {row['first']}, {row['second']} | {row['n']} | {counts} | {row['difference']:+.2f} | {row['p']:.2g} |"
        )
    return "\n".join(lines) + "\n"


def _pack(options: argparse.Namespace) -> None:
    sets = {}
    for given in options.sets:
        name, _, folder = given.rpartition("=")
        plain = name.removesuffix(":raw").removesuffix(":lower") or Path(folder).name
        sets[plain] = read_set(Path(folder), method_of(name), options.csv_fps)
    options.out.mkdir(parents=True, exist_ok=True)
    for name, rows in common(sets).items():
        write_pack(options.out / f"{name}.npz", rows)
        print(f"{name}: {len(rows)} motions, {sum(row.clip.duration for row in rows):.0f} s")


def _compare(options: argparse.Namespace) -> None:
    runs = {}
    for given in options.sets:
        name, _, folders = given.rpartition("=")
        runs[name or given] = trials_of([Path(folder) for folder in folders.split(",")])
    alone, pairs = compared(runs)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "follow.json").write_text(json.dumps({"sets": alone, "pairs": pairs}, indent=1) + "\n")
    (options.out / "follow.md").write_text(markdown(alone, pairs))
    print(markdown(alone, pairs))


def main() -> None:
    """Pack sets, or compare what was learned from them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("work", choices=("pack", "compare"))
    parser.add_argument("sets", nargs="+", help="pack: NAME=folder or NAME:raw=folder; compare: NAME=run[,run...]")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--csv-fps", type=float, default=60.0)
    options = parser.parse_args()
    try:
        {"pack": _pack, "compare": _compare}[options.work](options)
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
