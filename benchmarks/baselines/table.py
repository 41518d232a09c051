"""Several ways of whole-body control beside each other, motion by motion.

    python -m benchmarks.baselines.table results/ours results/omnih2o results/hover --against ours

Each folder holds `trials.csv` of `benchmarks.baselines`; what it calls its own method counts, its teacher does not. All
must have been tried on the same motions. p-values are paired by motion: McNemar's for success, sign flips for MPKPE
over the motions that both followed to the end.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.baselines.trial import REAL, TRIALS, rate, summary
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.intervals import mcnemar_test, sign_flip_test

KEYS = ["kind", "group", "name"]


def read(folder: Path) -> pd.DataFrame:
    """The trials of a folder's own method, under the folder's name."""
    path = Path(folder) / TRIALS
    try:
        table = pd.read_csv(path)
        method = json.loads((Path(folder) / "settings.json").read_text())["method"]
    except (OSError, ValueError, KeyError) as error:
        raise BadInput(path, "results of benchmarks.baselines", f"{type(error).__name__}: {error}") from None
    own = table[table["policy"] == method]
    if own.empty:
        raise BadInput(path, f"trials of {method}", f"of {', '.join(sorted(set(table['policy'])))}")
    return own.assign(policy=Path(folder).name).set_index(KEYS).sort_index()


def compared(tables: Sequence[pd.DataFrame], against: str, kind: str = "whole") -> list[dict]:
    """An entry for each policy, source (real, embedded) and split.

    Raises:
        BadInput: if they were tried on different motions, or `against` is none of them.
    """
    named = {str(table["policy"].iloc[0]): table for table in tables}
    if against not in named:
        raise BadInput("--against", " or ".join(named), repr(against))
    first = named[against]
    entries = []
    for name, table in named.items():
        if not table.index.equals(first.index):
            raise BadInput(name, f"trials of the motions of {against}", "others")
        for entry in summary(table.reset_index()):
            if entry["kind"] == kind and entry["group"] in (REAL, "embedded"):
                entries.append(entry | _paired(table, first, entry) if name != against else entry)
    return entries


def _paired(table: pd.DataFrame, first: pd.DataFrame, entry: dict) -> dict:
    """p-values of the entry's motions against those of the first."""
    groups = table.index.get_level_values("group")
    source = groups != "embedded" if entry["group"] == REAL else groups == "embedded"
    rows = source & (table.index.get_level_values("kind") == entry["kind"]) & (table["split"] == entry["split"])
    here, there = table[rows], first[rows]
    both = here["success"].to_numpy(bool) & there["success"].to_numpy(bool)
    away = (here["mpkpe_mm"].to_numpy() - there["mpkpe_mm"].to_numpy())[both]
    return {
        "p_success": mcnemar_test(here["success"].to_numpy(), there["success"].to_numpy()),
        "p_mpkpe": sign_flip_test(away),
        "both": int(np.sum(both)),
    }


def table_of(entries: Sequence[dict], against: str) -> str:
    """Markdown: success, MPKPE and MPJPE over the motions that were followed, and the p-values."""
    head = [
        "policy",
        "motions",
        "split",
        "n",
        "success",
        "own place",
        "MPKPE [mm]",
        "MPJPE [rad]",
        f"p against {against}",
    ]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for entry in sorted(entries, key=lambda e: (e["group"] != REAL, e["split"] != "train", e["policy"])):
        errors = (entry["mpkpe_mm_successful"]["value"], entry["mpjpe_rad_successful"]["value"])
        cells = [entry["policy"], entry["group"], entry["split"], str(entry["n"])]
        cells += [rate(entry["success"]), rate(entry["success_local"])]
        cells += ["-" if value is None else f"{value:.{digits}f}" for value, digits in zip(errors, (0, 3), strict=True)]
        cells.append(
            f"{entry['p_success']:.3f}; MPKPE {entry['p_mpkpe']:.3f} ({entry['both']})" if "both" in entry else ""
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the table; bad input is one line and status 2."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--against", required=True, help="name of the folder that the others are compared with")
    parser.add_argument("--kind", choices=("whole", "pieces"), default="whole")
    options = parser.parse_args()
    try:
        tables = [read(folder) for folder in options.folders]
        print(table_of(compared(tables, options.against, options.kind), options.against), end="")
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
