"""One delta action for each cluster against one for all: replay error, success after training on, magnitudes."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.study.deltas import ARMS, GENERAL, NONE, OWN
from benchmarks.study.round_tables import paired
from benchmarks.study.settings import frozen
from benchmarks.study.tables import cell, head, line, motions_of, rate, relative, signed
from bumblebee.errors import BadInput
from bumblebee.learning.delta import CARD, compare

ALL = "all"


def deltas_tables(run: Path) -> str:
    """All tables as Markdown.

    Raises:
        BadInput: if a step has not been done.
    """
    clusters = frozen(run)["clusters"]
    errors = {cluster: _read(run / f"errors-{cluster}.csv") for cluster in clusters}
    tried = pd.concat([_trials(run, cluster) for cluster in clusters], ignore_index=True)
    parts = [f"### Held-out recordings, error after 0.2 and 1 s [rad]\n\n{_errors(errors)}"]
    parts.append(f"### Success on the robot after training on\n\n{_success(tried, clusters)}")
    parts.append(f"### Mean absolute correction [rad]\n\n{_magnitudes(run, clusters)}")
    return "\n".join(parts)


def _read(path: Path) -> pd.DataFrame:
    if not path.exists():
        raise BadInput(path, "the results of every step", "none", "Run `benchmarks.study.deltas run` to its end.")
    return pd.read_csv(path)


def _trials(run: Path, cluster: str) -> pd.DataFrame:
    tables = [_read(run / f"tried-{arm}-{cluster}.csv").assign(arm=arm, cluster=cluster) for arm in ARMS]
    return pd.concat(tables, ignore_index=True).rename(columns={"name": "motion"})


def _errors(tables: dict[str, pd.DataFrame]) -> str:
    """Each arm's error with its relative change from none, and the own delta action's from the general one."""
    lines = head(["cluster", "arm", "rollouts", "0.2 s", "to none", "1 s", "to none", "own to general, 1 s"])
    every = pd.concat([table.assign(cluster=name) for name, table in tables.items()], ignore_index=True)
    for name, table in [*tables.items(), (ALL, every)]:
        table = table.assign(rollout=table["rollout"].astype(str))
        errors = {
            (arm, str(horizon)): own.sort_values("rollout")["error"].to_numpy()
            for (arm, horizon), own in table.groupby(["arm", "horizon"])
        }
        motions = motions_of(table, "arm")
        for arm in ARMS:
            lines.append(line([name, *_arm_errors(errors, motions, arm)]))
    return "\n".join(lines) + "\n"


def _arm_errors(errors: dict[tuple[str, str], np.ndarray], motions: list[str], arm: str) -> list[str]:
    horizons = sorted({horizon for _, horizon in errors}, key=float)

    def change(first: str, second: str) -> dict[str, dict[str, float]]:
        before, after = ({h: errors[name, h] for h in horizons} for name in (first, second))
        return compare(before, after, motions).change

    own, cells = change(NONE, arm), [arm, str(int(np.isfinite(errors[arm, horizons[-1]]).sum()))]
    for horizon in horizons:
        cells += [f"{own[horizon]['with']:.4f}", "" if arm == NONE else relative(own[horizon])]
    return [*cells, relative(change(GENERAL, OWN)[horizons[-1]]) if arm == OWN else ""]


def _success(tried: pd.DataFrame, clusters: Sequence[str]) -> str:
    lines = head(["cluster", "motions", "arm", "n", "success", "less none", "own less general", "p"])
    for cluster in (*clusters, ALL):
        for which in ("recorded", "held out"):
            rows = tried[(tried["set"] == which) & ((tried["cluster"] == cluster) | (cluster == ALL))]
            if len(rows):
                lines += [line([cluster, which, *_arm_success(rows, arm)]) for arm in ARMS]
    return "\n".join(lines) + "\n"


def _arm_success(rows: pd.DataFrame, arm: str) -> list[str]:
    here = rows["arm"] == arm
    cells = [arm, str(int(here.sum())), cell(rate(rows[here], "success"), 2)]
    cells.append("" if arm == NONE else signed(paired(rows, here, rows["arm"] == NONE)[0]))
    if arm != OWN:
        return [*cells, "", ""]
    value, p = paired(rows, here, rows["arm"] == GENERAL)
    return [*cells, signed(value), f"{p:.3g}"]


def _magnitudes(run: Path, clusters: Sequence[str]) -> str:
    folders = {what: run / f"delta-{what}" for what in (GENERAL, *clusters)}
    cards = {what: json.loads((folder / CARD).read_text()) for what, folder in folders.items()}
    joints = list(cards[GENERAL]["magnitude_rad"])
    lines = head(["delta action", "rollouts", *joints])
    for what, card in cards.items():
        sizes = [f"{card['magnitude_rad'][joint]:.4f}" for joint in joints]
        lines.append(line([what, str(card["rollouts"]), *sizes]))
    return "\n".join(lines) + "\n"
