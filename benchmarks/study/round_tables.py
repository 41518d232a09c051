"""Results of rounds: success on each robot, error on held-out recordings, what was found; intervals over motions."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.study.round_settings import RoundsConfig
from benchmarks.study.rounds import ARMS, BASE, Place
from benchmarks.study.tables import cell, head, line, motions_of, rate, relative, signed
from bumblebee.deploy.stand_in_effects import read_sealed
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import Estimate, mean_by_motion, motion_means, sign_flip_test
from bumblebee.learning.delta import Gain, compare

SETS = ("recorded", "held out")
NONE = next(iter(ARMS))
"""The arm that corrects nothing."""


def rounds_tables(out: Path, robots: Path, config: RoundsConfig) -> str:
    """All tables as Markdown.

    Raises:
        BadInput: if a step of a robot has not been done.
    """
    names = sorted(path.name for path in out.iterdir() if (path / BASE).is_dir())
    trials = pd.concat([_of_robot(out, robot, config) for robot in names], ignore_index=True)
    parts = [f"### {robot}\n\n{_success(trials[trials['robot'] == robot], config)}" for robot in names]
    parts.append(f"### Recordings of round 1 that took no part, error after 0.2 and 1 s\n\n{_errors(out, names)}")
    parts.append(f"### What the delta actions do, mean absolute correction [rad]\n\n{_magnitudes(out, names, config)}")
    parts.append(f"### What diagnoses found, and what was sealed\n\n{_found(out, robots, names, config)}")
    return "\n".join(parts)


def read_tried(out: Path, place: Place, config: RoundsConfig) -> pd.DataFrame:
    """A place's trials, a row an episode."""
    files = [out / place.name / f"tried-{shard}.csv" for shard in range(config.shards)]
    for file in files:
        if not file.exists():
            raise BadInput(file, "the trials of every round", "none", "Run `benchmarks.study.rounds run` to its end.")
    return pd.concat([pd.read_csv(file) for file in files], ignore_index=True)


def paired(rows: pd.DataFrame, first: pd.Series, second: pd.Series) -> tuple[Estimate, float]:
    """Success of some rows less that of others, paired by motion and seed, and the p-value of sign flips."""
    one, other = (rows[which].set_index(["motion", "seed"])["success"].astype(float) for which in (first, second))
    away = (one - other).dropna()
    motions = away.index.get_level_values("motion").to_numpy()
    return mean_by_motion(away.to_numpy(), motions), sign_flip_test(motion_means(away.to_numpy(), motions))


def _of_robot(out: Path, robot: str, config: RoundsConfig) -> pd.DataFrame:
    tables = [read_tried(out, Place(robot, BASE, 0), config).assign(arm=BASE, round=0)]
    for arm in ARMS:
        for round_ in range(1, config.rounds + 1):
            tables.append(read_tried(out, Place(robot, arm, round_), config).assign(arm=arm, round=round_))
    return pd.concat(tables, ignore_index=True).rename(columns={"name": "motion"}).assign(robot=robot)


def _success(rows: pd.DataFrame, config: RoundsConfig) -> str:
    """A row a set of motions and arm: success after each round, and what the last is beside others."""
    last, rounds = config.rounds, range(1, config.rounds + 1)
    after = [f"round {round_}" for round_ in rounds]
    titles = ["motions", "correction", "n", "round 0", *after, f"{last} less 0", f"{last} less none", "p"]
    lines = head([*titles, f"MPKPE 0, {last} [mm]"])
    for which in SETS:
        own = rows[rows["set"] == which]
        for arm in ARMS:
            lines.append(line([which, arm, *_cells(own, arm, last)]))
    return "\n".join(lines) + "\n"


def _cells(rows: pd.DataFrame, arm: str, last: int) -> list[str]:
    def of(name: str, round_: int) -> pd.Series:
        return (rows["arm"] == name) & (rows["round"] == round_)

    before, here = of(BASE, 0), of(arm, last)
    cells = [str(int(here.sum())), cell(rate(rows[before], "success"), 2)]
    cells += [cell(rate(rows[of(arm, round_)], "success"), 2) for round_ in range(1, last + 1)]
    cells.append(signed(paired(rows, here, before)[0]))
    value, p = paired(rows, here, of(NONE, last))
    cells += ["", ""] if arm == NONE else [signed(value), f"{p:.2g}"]
    return [*cells, f"{rows[before]['mpkpe_mm'].mean():.0f}, {rows[here]['mpkpe_mm'].mean():.0f}"]


def _errors(out: Path, names: Sequence[str]) -> str:
    titles = [
        "robot",
        "simulator",
        "rollouts",
        "after 0.2 s",
        "to declared",
        "after 1 s",
        "to declared",
        "both to delta",
    ]
    lines = head([*titles, "the gate"])
    for robot in names:
        table = pd.read_csv(out / Place(robot, BASE, 1).name / "errors.csv")
        errors = {
            (name, str(horizon)): own.sort_values("rollout")["error"].to_numpy()
            for (name, horizon), own in table.groupby(["correction", "horizon"])
        }
        motions = motions_of(table, "correction")
        for name in table["correction"].unique():
            lines.append(line([robot, *_replayed(errors, motions, name)]))
    return "\n".join(lines) + "\n"


def _replayed(errors: dict[tuple[str, str], np.ndarray], motions: list[str], name: str) -> list[str]:
    """The cells of one simulator."""
    horizons = sorted({horizon for _, horizon in errors}, key=float)

    def gain(first: str, second: str) -> Gain:
        before, after = ({h: errors[one, h] for h in horizons} for one in (first, second))
        return compare(before, after, motions)

    own, cells = gain("declared", name).change, [name, str(int(np.isfinite(errors[name, horizons[-1]]).sum()))]
    for horizon in horizons:
        cells += [f"{own[horizon]['with']:.4f}", "" if name == "declared" else relative(own[horizon])]
    cells.append(relative(gain("delta", "both").change[horizons[-1]]) if name == "both" else "")
    before = {"delta": "declared", "both": "physics"}.get(name)
    if before is None:
        return [*cells, ""]
    return [*cells, "kept" if gain(before, name).promoted else "not kept"]


def _magnitudes(out: Path, names: Sequence[str], config: RoundsConfig) -> str:
    rows = {}
    for robot in names:
        for arm in ("delta", "both"):
            for round_ in range(1, config.rounds + 1):
                card = json.loads((out / Place(robot, arm, round_).name / "delta" / "card.json").read_text())
                rows[robot, arm, str(round_)] = card["magnitude_rad"]
    joints = list(next(iter(rows.values())))
    lines = head(["robot", "arm", "round", *joints])
    lines += [line([*key, *(f"{own[joint]:.3f}" for joint in joints)]) for key, own in rows.items()]
    return "\n".join(lines) + "\n"


def _found(out: Path, robots: Path, names: Sequence[str], config: RoundsConfig) -> str:
    lines = head(["robot", "sealed", "arm", "round", "found"])
    for robot in names:
        sealed = ", ".join(sorted(str(row["effect"]) for row in read_sealed(robots / f"{robot}.json"))) or "nothing"
        places = [Place(robot, BASE, 1)]
        places += [
            Place(robot, arm, r) for r in range(2, config.rounds + 1) for arm in ARMS if "diagnosis" in ARMS[arm]
        ]
        for place in places:
            document = json.loads((out / place.name / "diagnosis" / "diagnosis.json").read_text())
            found = "; ".join(" ".join([row["effect"], *row["where"]]) for row in document["effects"]) or "nothing"
            lines.append(line([robot, sealed, place.arm, str(place.round), found]))
    return "\n".join(lines) + "\n"
