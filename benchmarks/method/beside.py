"""Runs of other learners and seeds beside each other: base policy and experts before any round."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from benchmarks.method.places import BASE, OWN
from benchmarks.method.settings import NAMED, Method, chosen
from benchmarks.method.tables import ROWS, read
from benchmarks.study.motions import Motions
from benchmarks.study.settings import freeze, frozen
from benchmarks.study.tables import SPLITS, difference, head, line, methods_table, rate, signed
from bumblebee.errors import BadInput

LEARNERS = {"world_model": "through a model", "ppo": "PPO", "small": "in seconds"}


def beside(runs: Sequence[Path], motions: Motions) -> str:
    """Tables of several runs as Markdown.

    Raises:
        BadInput: if a run is of other motions or settings, or nothing in it was tried.
    """
    tried = [_tried(run, motions) for run in runs]
    if len({stamp for _, stamp in tried}) < len(runs):
        raise BadInput("runs", "runs of different settings or seeds", "one twice", "Name each once.")
    rows = pd.concat([table for table, _ in tried], ignore_index=True)
    names = {f"{key} {name}": f"{ROWS[key]}, {LEARNERS[name]}" for name in NAMED for key in (BASE, OWN)}
    parts = [f"<!-- methods {' '.join(stamp for _, stamp in tried)}, motions {motions.hash} -->\n"]
    for robot, own in rows.groupby("robot"):
        parts.append(f"### {robot} robots\n\n{methods_table(own, names, 'all seeds')}\n{_seeds(own, names)}")
        if pairs := _pairs(own):
            parts.append(pairs)
    return "\n".join(parts)


def _tried(run: Path, motions: Motions) -> tuple[pd.DataFrame, str]:
    """Trials of a run's base policy and of its experts, with learner and seed; the hash of what the run is held to."""
    began = frozen(run)
    name, seed = began.get("settings"), began["study"].get("seed")
    if name not in NAMED or seed is None:
        raise BadInput(run, "a run of `benchmarks.method`", "another's settings", "Name the --out of such a run.")
    method: Method = chosen(name, seed)
    stamp = freeze(run, method, settings=name, motions=motions.hash)
    tables = [(key, read(run, key, "tried", method, motions)) for key in (BASE, OWN)]
    found = [table.assign(arm=f"{key} {name}", seed=seed) for key, table in tables if table is not None]
    if not found:
        raise BadInput(run, "trials of the base policy", "none", "Run `benchmarks.method run` on until they are done.")
    return pd.concat(found, ignore_index=True), stamp


def _seeds(rows: pd.DataFrame, names: dict[str, str]) -> str:
    """Success in the own place by seed."""
    seeds = sorted(rows["seed"].unique())
    lines = head(["own place", "motions", *(f"seed {seed}" for seed in seeds)])
    for split, which in SPLITS.items():
        for arm, told in names.items():
            own = rows[(rows["arm"] == arm) & (rows["split"] == split)]
            each = [own[own["seed"] == seed] for seed in seeds]
            if not own.empty:
                values = [f"{rate(part, 'success_local').value:.2f}" if len(part) else "" for part in each]
                lines.append(line([told, which, *values]))
    return "\n".join(lines) + "\n"


def _pairs(rows: pd.DataFrame) -> str:
    """PPO less the learner through a model, and experts less their base policy, where both have the seed."""
    pairs = [(f"{key} ppo", f"{key} world_model") for key in (BASE, OWN)]
    pairs += [(f"{OWN} {name}", f"{BASE} {name}") for name in NAMED]
    lines = head(["own place", "motions", "seeds", "difference", "p"])
    for split, which in SPLITS.items():
        for first, second in pairs:
            seeds = [set(rows[rows["arm"] == arm]["seed"]) for arm in (first, second)]
            if shared := seeds[0] & seeds[1]:
                own = rows[(rows["split"] == split) & rows["seed"].isin(shared)]
                value, p = difference(own, first, second, "success_local")
                told = " less ".join(_told(arm) for arm in (first, second))
                lines.append(line([told, which, str(len(shared)), signed(value), f"{p:.3g}"]))
    return "\n".join(lines) + "\n" if len(lines) > 2 else ""


def _told(arm: str) -> str:
    key, name = arm.split(" ")
    return f"{ROWS[key]}, {LEARNERS[name]}"
