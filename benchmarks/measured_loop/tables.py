"""Tables of a run: replay and success of the four arms, paired by motion, with intervals over motions."""

import json
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.measured_loop.settings import ARMS
from benchmarks.measured_loop.work import CARD, TRIED
from benchmarks.study.tables import cell, head, line, rate, relative, signed
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import mean_by_motion, motion_means, sign_flip_test
from bumblebee.learning.delta import Gain, compare

MODELS = {"none": "declared", "physics": "corrected", "residual": "declared + residual", "both": "corrected + residual"}


def tables(out: Path) -> str:
    """All tables of a run as Markdown; seeds are further rollouts of a motion.

    Raises:
        BadInput: if nothing has been judged yet.
    """
    found = sorted(out.glob("seed-*/robot-*/replay.csv"))
    if not found:
        raise BadInput(out, "a run with replay.csv of a robot", "none", "Run it without --table first.")
    lines = head(["robot", "model", "after [s]", "error [rad]", "to declared", "true state", "to declared", "the gate"])
    for name in sorted({file.parent.name for file in found}):
        rows = pd.concat([pd.read_csv(f).assign(seed=f.parts[-3]) for f in found if f.parent.name == name])
        for arm, told in MODELS.items():
            for horizon in sorted(rows["horizon"].unique()):
                cells = [name, told, f"{horizon:g}"]
                for by in ("readings", "truth"):
                    change = changed(rows[rows["by"] == by], "none", arm).change[str(horizon)]
                    cells += [f"{change['with']:.4f}", "" if arm == "none" else relative(change)]
                lines.append(line([*cells, _gate(out, name, arm) if horizon == rows["horizon"].max() else ""]))
    lines += ["", *head(["robot", "after [s]", "physics less residual alone", "both less physics"])]
    for name in sorted({file.parent.name for file in found}):
        rows = pd.concat([pd.read_csv(f).assign(seed=f.parts[-3]) for f in found if f.parent.name == name])
        own = rows[rows["by"] == "readings"]
        pairs = [changed(own, *pair).change for pair in (("residual", "physics"), ("physics", "both"))]
        lines += [line([name, f"{float(h):g}", *(relative(pair[h]) for pair in pairs)]) for h in pairs[0]]
    return "\n".join([*lines, *_success(out)]) + "\n"


def changed(rows: pd.DataFrame, before: str, after: str) -> Gain:
    """An arm against another, on one robot's errors."""
    keys = ["seed", "rollout", "motion"]
    rows = rows.assign(stretch=rows.groupby(["seed", "rollout", "arm", "horizon"]).cumcount())
    wide = rows.set_index([*keys, "stretch", "horizon", "arm"])["error"].unstack(["horizon", "arm"])
    motions = wide.index.get_level_values("motion").tolist()
    errors = ({str(h): wide[h][arm].to_numpy() for h in sorted(rows["horizon"].unique())} for arm in (before, after))
    return compare(*errors, motions)


def _gate(out: Path, name: str, arm: str) -> str:
    cards = [json.loads(file.read_text()) for file in sorted(out.glob(f"seed-*/{name}/{arm}/{CARD}"))]
    return ", ".join("kept" if card["kept"] else f"dropped: {card['gain']['reason']}" for card in cards)


def _success(out: Path) -> list[str]:
    """Lines of the table of trials on the robots, if there were any."""
    files = sorted(out.glob(f"seed-*/robot-*/policy/*/{TRIED}"))
    if not files:
        return []
    every = pd.concat([pd.read_csv(file).assign(run=file.parts[-5], motion=lambda t: t["name"]) for file in files])
    lines = ["", *head(["robot", "motions", "arm", "success", "less none", "p"])]
    for (name, which), rows in every.groupby(["robot", "set"]):
        wide = rows.set_index(["run", "name", "arm"])["success"].unstack("arm").astype(float)
        for arm in [arm for arm in ARMS if arm in wide]:
            cells = [str(name), str(which), arm, cell(rate(rows[rows["arm"] == arm], "success"), 2), "", ""]
            if arm != "none" and "none" in wide:
                away, motions = (wide[arm] - wide["none"]).to_numpy(), wide.index.get_level_values("name").to_numpy()
                kept = np.isfinite(away)
                cells[-2] = signed(mean_by_motion(away[kept], motions[kept]))
                cells[-1] = f"{sign_flip_test(motion_means(away[kept], motions[kept])):.3g}"
            lines.append(line(cells))
    return lines
