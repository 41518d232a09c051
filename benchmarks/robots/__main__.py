"""Policies of several robots on the same motions, beside the first one's: the table of docs/results/robots.md.

    BUMBLEBEE_ROBOT=h1 python -m benchmarks.study prepare PEOPLE... --texts HUMANML3D --clusters 4 --out h1/motions
    BUMBLEBEE_ROBOT=h1 python -m benchmarks.method run --motions h1/motions --out h1/run --only train tried --minutes 9
    python -m benchmarks.robots g1_23 g1_29 h1 --out robots.md

A name is a folder with `motions` and `run`. What the filter of either robot dropped is left out of the pairs.
"""

import argparse
from pathlib import Path

import pandas as pd

from benchmarks.method.places import BASE
from benchmarks.method.settings import NAMED
from benchmarks.study.tables import RATES, SPLITS, cell, difference, estimate, head, line, rate, signed
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import Estimate
from bumblebee.io.write import write_file


def trials_of(folder: Path) -> pd.DataFrame:
    """Trials of a robot's base policy, a row a piece and robot (declared, drawn).

    Raises:
        BadInput: not tried, or not to the end.
    """
    files = sorted((folder / "run" / BASE).glob("tried-*.csv"))
    if len(files) < NAMED["world_model"].shards:
        came = f"{len(files)}"
        raise BadInput(
            folder, f"trials of {NAMED['world_model'].shards} shards", came, "`benchmarks.method run` again."
        )
    labels = pd.read_csv(folder / "motions" / "labels.csv")[["name", "motion"]]
    trials = pd.concat([pd.read_csv(file) for file in files], ignore_index=True)
    return trials.merge(labels, on="name", validate="many_to_one").assign(arm=folder.name, seed=0)


def table(folders: list[Path]) -> str:
    """Success of each robot's policy, and each less the first's, paired by piece, as Markdown."""
    rows = pd.concat([trials_of(folder) for folder in folders], ignore_index=True)
    first = folders[0].name
    titles = [
        "robot",
        "tried on",
        "motions",
        "n",
        *RATES.values(),
        "MPJPE [rad]",
        "MPKPE [mm]",
        f"own place, less {first}",
    ]
    lines = head(titles)
    for (tried_on, split), some in rows.groupby(["robot", "split"], sort=False):
        for name in (folder.name for folder in folders):
            own = some[some["arm"] == name]
            rates = [cell(rate(own, column), 2) for column in RATES]
            errors = [cell(estimate(own, "mpjpe_rad"), 3), cell(estimate(own, "mpkpe_mm"), 0)]
            away = "" if name == first else signed(_paired(some, name, first))
            lines.append(line([name, tried_on, SPLITS[split], str(own["motion"].nunique()), *rates, *errors, away]))
    return "\n".join(lines) + "\n"


def _paired(rows: pd.DataFrame, one: str, other: str) -> Estimate:
    """Difference over the pieces that both were tried on."""
    shared = set.intersection(*(set(rows[rows["arm"] == arm]["name"]) for arm in (one, other)))
    return difference(rows[rows["name"].isin(shared)], one, other, "success_local")[0]


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    write_file(options.out, table(options.folders).encode())


if __name__ == "__main__":
    main()
