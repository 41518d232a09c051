"""Tables of a run, of what has been tried so far: rows beside each other, rounds by cluster, corrections, diagnoses."""

import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.method.places import ARMS, BASE, GENERAL, LONGER, ONE, OWN, RANDOM, TOGETHER, Place, arm, student
from benchmarks.method.settings import Method
from benchmarks.method.students import AHEAD, changed, compared
from benchmarks.study.motions import Motions
from benchmarks.study.tables import (
    RATES,
    SPLITS,
    cell,
    difference,
    head,
    line,
    methods_table,
    motions_of,
    rate,
    relative,
    signed,
)
from bumblebee.learning.delta import compare
from bumblebee.stand_in.sealed import read_sealed

ROWS = {
    "base": "base policy",
    OWN: "experts before any round",
    GENERAL: "General Init: of the base policy",
    ONE: "one policy, the same steps",
    RANDOM: "random clusters",
    LONGER: "without rounds, the same steps",
    "delta": "**BumbleBee**: delta actions",
    "physics": "physics in the place of the delta actions",
    "both": "physics and delta actions",
}
WHOLE = "delta"
"""The row that is the paper's method."""
_CHANGE = ("", ", less the usual", ", less the experts")
SEALED = "sealed"
KINDS: dict[str, Callable[[str], str] | None] = {
    "Transformers": student,
    "Transformers that see the reference ahead": partial(changed, name=AHEAD),
    "Experts": None,
}
"""Sections, and what is distilled from a line in each; None: its experts themselves."""


def method_tables(out: Path, method: Method, motions: Motions, robots: Path | None) -> str:
    """All tables as Markdown."""
    names, parts = sealed_on(out), []
    for what, folder in KINDS.items():
        rows = _rows(out, method, motions, names, folder)
        for robot in ("declared", "drawn", SEALED):
            own = rows[rows["on"] == robot]
            if not own.empty:
                parts.append(f"### {what}, {robot} robots\n\n{methods_table(own, ROWS, 'row')}\n{_pairs(own)}")
        if folder is student and any((out / who / "tried-0.csv").exists() for who in compared()):
            parts.append(f"### Transformers with one thing changed, declared robot\n\n{_changes(out, method, motions)}")
    if names:
        parts.append(
            f"### Experts by cluster after each round, sealed robots\n\n{_rounds(out, method, motions, names)}"
        )
        parts.append(f"### Recordings that judge, replayed: error after 0.2 and 1 s\n\n{_errors(out, names)}")
        parts.append(f"### What the delta actions do, mean absolute correction [rad]\n\n{_magnitudes(out, names)}")
    if names and robots is not None:
        parts.append(f"### What diagnoses found, and what was sealed\n\n{_found(out, names, robots)}")
    return "\n".join(parts)


def figures(out: Path, method: Method, motions: Motions) -> dict[str, float]:
    """Success in the own place of every row that was tried: section, robots, motions, row -> value, low and high."""
    found, robots = {}, sealed_on(out)
    for what, folder in KINDS.items():
        rows = _rows(out, method, motions, robots, folder)
        for (on, split, key), own in rows.groupby(["on", "split", "arm"]):
            value = rate(own, "success_local")
            told = f"{what}/{on}/{SPLITS[split]}/{_plain(key)}"
            found |= {told: value.value, f"{told} low": value.low, f"{told} high": value.high}
    return found


def sealed_on(out: Path) -> list[str]:
    """Names of the robots of a run."""
    return sorted(path.name for path in out.iterdir() if (path / "own").is_dir() and path.name != "declared")


def read(out: Path, who: str, kind: str, method: Method, motions: Motions) -> pd.DataFrame | None:
    """Trials of a policy or of a line's experts; None where they are not whole.

    Args:
        out: the run's folder.
        who: folder below it.
        kind: `tried` or `sealed-ROBOT`.
        method: says how many shards there are.
        motions: the study's; columns motion and cluster come from them.
    """
    files = [out / who / f"{kind}-{shard}.csv" for shard in range(method.shards)]
    if not all(file.exists() for file in files):
        return None
    table = pd.concat([pd.read_csv(file) for file in files], ignore_index=True)
    return table.merge(motions.labels[["name", "motion", "cluster"]], on="name", validate="many_to_one")


def _rows(
    out: Path, method: Method, motions: Motions, robots: Sequence[str], folder: Callable[[str], str] | None
) -> pd.DataFrame:
    """Trials of all rows; `on` is declared, drawn or sealed, and `seed` the number of the robot that a row is for."""
    tables = []
    for key, who, own, index in _who(robots, method, folder):
        if (table := read(out, who, "tried", method, motions)) is not None:
            tables.append(table.assign(arm=key, seed=index, on=table["robot"]))
        for robot in robots if own is None else [own]:
            if (table := read(out, who, f"sealed-{robot}", method, motions)) is not None:
                tables.append(table.assign(arm=key, seed=0, on=SEALED))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=["on"])


def _who(
    robots: Sequence[str], method: Method, folder: Callable[[str], str] | None
) -> Iterator[tuple[str, str, str | None, int]]:
    """Row, folder below the run's, the robot that it is for, and that one's number."""
    for key in (BASE, OWN, GENERAL, ONE, RANDOM, LONGER):
        if folder is not None and key != BASE:
            yield key, folder(key), None, 0
        elif folder is None and key != GENERAL:
            yield key, key, None, 0
    for index, robot in enumerate(robots):
        for name in ARMS:
            line_ = arm(robot, name)
            yield name, folder(line_) if folder else Place(robot, name, method.rounds).name, robot, index


def _changes(out: Path, method: Method, motions: Motions) -> str:
    """The students of the experts before any round: KL at the end, success in the own place, what the change brings."""
    tables = {who: read(out, who, "tried", method, motions) for who in (OWN, *compared())}
    tried = [table.assign(arm=who, seed=0) for who, table in tables.items() if table is not None]
    lines = head(["student", "KL", *(f"{which}{told}" for which in SPLITS.values() for told in _CHANGE)])
    rows = pd.concat(tried, ignore_index=True)
    rows = rows[rows["robot"] == "declared"]
    for who, each in compared().items():
        if tables[who] is None:
            continue
        cells = [each.told, f"{json.loads((out / who / 'done.json').read_text())['kl']:.1f}"]
        for split in SPLITS:
            own = rows[rows["split"] == split]
            cells.append(cell(rate(own[own["arm"] == who], "success_local"), 2))
            for other in (student(OWN), OWN):
                there = who != other and (own["arm"] == other).any()
                cells.append(signed(difference(own, who, other, "success_local")[0]) if there else "")
        lines.append(line(cells))
    return "\n".join(lines) + "\n"


def _pairs(rows: pd.DataFrame) -> str:
    """Rows less others, where both were tried on the same motions and robots."""
    pairs = [(WHOLE, key) for key in ROWS if key != WHOLE]
    pairs += [(OWN, BASE), ("physics", LONGER), ("physics", ONE), ("both", "physics"), (LONGER, ONE), (LONGER, RANDOM)]
    lines = head(["difference", "motions", *RATES.values(), "p, own place"])
    for split, which in SPLITS.items():
        own = rows[rows["split"] == split]
        for first, second in pairs:
            both = _alike(own, first, second)
            if both.empty:
                continue
            each = {column: difference(both, first, second, column) for column in RATES}
            told = f"{_plain(first)} less {_plain(second)}"
            values = [signed(value) for value, _ in each.values()]
            lines.append(line([told, which, *values, f"{each['success_local'][1]:.3g}"]))
    return "\n".join(lines) + "\n" if len(lines) > len(head([])) else ""


def _alike(rows: pd.DataFrame, first: str, second: str) -> pd.DataFrame:
    """Rows of two arms where both were tried; one that is for no robot stands beside each robot's."""
    keys = ["seed", "robot", "name"]
    one, other = (rows[rows["arm"] == arm_] for arm_ in (first, second))
    if one.empty or other.empty:
        return rows.iloc[:0]
    seeds = sorted({*one["seed"], *other["seed"]})
    one, other = (
        each if key in ARMS else pd.concat([each.assign(seed=seed) for seed in seeds])
        for key, each in ((first, one), (second, other))
    )
    shared = one.set_index(keys).index.intersection(other.set_index(keys).index)
    both = pd.concat([one, other])
    return both[both.set_index(keys).index.isin(shared)]


def _rounds(out: Path, method: Method, motions: Motions, robots: Sequence[str]) -> str:
    """Success of the experts after each round that was tried, in the own place: all motions, then by cluster."""
    after = [f"round {number}" for number in range(1, method.rounds + 1)]
    lines = head(["robot", "correction", "motions", "n", "round 0", *after, "last less 0", "pelvis rule, last less 0"])
    for robot in robots:
        for name in ARMS:
            line_ = [OWN, *(Place(robot, name, number).name for number in range(1, method.rounds + 1))]
            tables = [read(out, who, f"sealed-{robot}", method, motions) for who in line_]
            done = [table.assign(arm=str(i), seed=0) for i, table in enumerate(tables) if table is not None]
            if tables[0] is not None and len(done) > 1:
                rows = pd.concat(done, ignore_index=True)
                lines += [line([robot, name, *cells]) for cells in _after_rounds(rows, method.rounds)]
    return "\n".join(lines) + "\n"


def _after_rounds(rows: pd.DataFrame, rounds: int) -> Iterator[list[str]]:
    """Cells of each set of motions; a round that was not tried has none."""
    sets = {which: rows[rows["split"] == split] for split, which in SPLITS.items()}
    sets |= {cluster: rows[rows["cluster"] == cluster] for cluster in sorted(rows["cluster"].unique())}
    last = rows["arm"].max()
    for told, own in sets.items():
        cells = [told, str(own["motion"].nunique())]
        for number in range(rounds + 1):
            there = own[own["arm"] == str(number)]
            cells.append("" if there.empty else cell(rate(there, "success_local"), 2))
        columns = ("success_local", "success_upright")
        yield [*cells, *(signed(difference(own, last, "0", column)[0]) for column in columns)]


def _errors(out: Path, robots: Sequence[str]) -> str:
    """Replay errors of the simulators by cluster, and of each cluster's own delta action beside the general one."""
    titles = ["robot", "cluster", "simulator", "rollouts", "0.2 s", "to declared", "1 s", "to declared", "to general"]
    lines = head(titles)
    for robot in robots:
        path = out / Place(robot, "own", 1).recorded / "errors.csv"
        if not path.exists():
            continue
        table = pd.read_csv(path)
        for cluster in [*sorted(table["cluster"].unique()), TOGETHER]:
            own = table if cluster == TOGETHER else table[table["cluster"] == cluster]
            lines += [line([robot, cluster, *cells]) for cells in _replayed(own)]
    return "\n".join(lines) + "\n"


def _replayed(table: pd.DataFrame) -> Iterator[list[str]]:
    errors = {
        name: {str(h): part.sort_values("rollout")["error"].to_numpy() for h, part in own.groupby("horizon")}
        for name, own in table.groupby("correction")
    }
    motions = motions_of(table, "correction")
    for name in table["correction"].unique():
        change, horizons = compare(errors["declared"], errors[name], motions).change, sorted(errors[name], key=float)
        cells = [name, str(int(np.isfinite(errors[name][horizons[-1]]).sum()))]
        for horizon in horizons:
            cells += [f"{change[horizon]['with']:.4f}", "" if name == "declared" else relative(change[horizon])]
        general = compare(errors["general delta"], errors[name], motions).change[horizons[-1]]
        yield [*cells, relative(general) if name == "delta" else ""]


def _magnitudes(out: Path, robots: Sequence[str]) -> str:
    rows = {}
    for robot in robots:
        for path in sorted((out / robot).glob("*/r*/*/delta/card.json")):
            name, round_, cluster = path.parts[-5:-2]
            rows[robot, name, round_, cluster] = json.loads(path.read_text())["magnitude_rad"]
    joints = list(next(iter(rows.values()), {}))
    lines = head(["robot", "arm", "round", "cluster", *joints])
    lines += [line([*key, *(f"{own[joint]:.3f}" for joint in joints)]) for key, own in rows.items()]
    return "\n".join(lines) + "\n"


def _found(out: Path, names: Sequence[str], robots: Path) -> str:
    lines = head(["robot", "sealed", "arm", "round", "found"])
    for robot in names:
        sealed = ", ".join(sorted(str(row["effect"]) for row in read_sealed(robots / f"{robot}.json"))) or "nothing"
        for path in sorted((out / robot).glob("*/r*/diagnosis/diagnosis.json")):
            name, round_ = path.parts[-4:-2]
            document = json.loads(path.read_text())
            found = "; ".join(" ".join([row["effect"], *row["where"]]) for row in document["effects"]) or "nothing"
            lines.append(line([robot, sealed, name, round_, found]))
    return "\n".join(lines) + "\n"


def _plain(key: str) -> str:
    return ROWS[key].split(":")[0].strip("*")
