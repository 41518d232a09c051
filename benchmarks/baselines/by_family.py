"""A policy's trials by source and family, on the declared robot and on drawn ones, by three rules: a card's table.

    python -m benchmarks.baselines.relatives FOLDER --motions motions.npz --kinds itself --out declared.csv
    python -m benchmarks.baselines.relatives FOLDER --motions motions.npz --kinds itself --robots paper --out drawn.csv
    python -m benchmarks.baselines.by_family imu --motions motions.npz --declared declared.csv --drawn drawn.csv

World: every key body within .4 m (.8 m where the motion travels), no fall. Own place: the same with the reference moved
over the robot. Pelvis: height within .25 m, gravity within .8.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from benchmarks.baselines.trial import rate
from benchmarks.motion_pack import EMBEDDED, Packed, read_pack, whole_motions
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import success_rate
from bumblebee.last_line import guarded

RULES = {"success": "world", "success_local": "own place", "success_upright": "pelvis"}


def read(file: Path, policy: str, motions: Sequence[Packed]) -> pd.DataFrame:
    """Trials of a policy from `benchmarks.baselines.relatives` on these motions, with the source of each.

    Raises:
        BadInput: if it was not tried there, or on other motions.
    """
    if not file.is_file():
        raise BadInput(file, "trials of benchmarks.baselines.relatives", "no such file")
    every = pd.read_csv(file, keep_default_na=False)
    own = every[(every["policy"] == policy) & (every["kind"] == "itself")]
    if own.empty:
        raise BadInput(file, f"trials of {policy}", f"of {', '.join(sorted(set(every['policy'])))}")
    if list(own["name"]) != [row.clip.name for row in motions]:
        raise BadInput(file, f"trials of the {len(motions)} motions of --motions", f"{len(own)}, or others")
    flags = {rule: own[rule].astype(str) == "True" for rule in RULES}
    return own.assign(**flags, group=[row.group for row in motions])


def table(tables: dict[str, pd.DataFrame]) -> str:
    """Markdown: all motions and each source with 95 % intervals over motions, then each family's counts."""
    head = ["motions", "n", *(f"{robots}: {rule}" for robots in tables for rule in RULES.values())]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    first = next(iter(tables.values()))
    sets = [("all", None, None)]
    sets += [(source, "group", source) for source in sorted(set(first["group"]))]
    sets += [(family or "no family", "family", family) for family in sorted(set(first["family"]))]
    for name, column, value in sets:
        own = [rows if column is None else rows[rows[column] == value] for rows in tables.values()]
        cells = [_cell(rows, rule, column == "family") for rows in own for rule in RULES]
        lines.append("| " + " | ".join([name, str(len(own[0])), *cells]) + " |")
    return "\n".join(lines)


def _cell(rows: pd.DataFrame, rule: str, counted: bool) -> str:
    if counted:
        return str(int(rows[rule].sum()))
    return rate(success_rate(rows[rule].to_numpy(), rows["name"].to_numpy()).as_dict())


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.baselines.by_family", description=__doc__.splitlines()[0]
    )
    parser.add_argument("policy", help="name of its folder")
    parser.add_argument("--motions", type=Path, required=True, help="file of benchmarks.motion_pack")
    parser.add_argument("--declared", type=Path, help="trials on the robot as it is")
    parser.add_argument("--drawn", type=Path, help="trials on robots drawn from a randomisation")
    return parser.parse_args(arguments)


def run(options: argparse.Namespace) -> int:
    """Print the table."""
    motions = [row for row in whole_motions(read_pack(options.motions)) if row.group != EMBEDDED]
    files = {name: file for name in ("declared", "drawn") if (file := getattr(options, name)) is not None}
    if not files:
        raise BadInput("the command line", "--declared FILE, --drawn FILE or both", "neither")
    print(table({robots: read(file, options.policy, motions) for robots, file in files.items()}))
    return 0


if __name__ == "__main__":
    raise SystemExit(guarded(lambda: run(parse())))
