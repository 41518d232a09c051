"""The paper's task: what each deviation from its text gives, one policy each."""

from pathlib import Path

import pandas as pd

from benchmarks.study.jobs import PAPER_ARMS, PAPER_LONGER, longer_of, paper_of
from benchmarks.study.motions import Motions
from benchmarks.study.pages.tables import SPLITS, cell, estimate, head, line, rate, read_trials
from benchmarks.study.settings import Study
from benchmarks.study.trying import TRIALS
from bumblebee.learning.learner import CURVE


def paper_tables(out: Path, study: Study, motions: Motions) -> str:
    """Success of each arm that was tried, with intervals over motions; reward and deviation at the end of its curve.

    Raises:
        BadInput: if none was.
    """
    lines = head(["arm", "motions", "n", "success", "pelvis rule", "MPKPE [mm]", "reward", "deviation", "episode [s]"])
    seed = study.seeds[0]
    named = {PAPER_ARMS[arm]: paper_of(seed, arm) for arm in PAPER_ARMS}
    named |= {f"{PAPER_ARMS[arm]}, {study.base_steps / 1e6:g} M": longer_of(seed, arm) for arm in PAPER_LONGER}
    tried = {told: name for told, name in named.items() if (out / name / TRIALS).exists()}
    for told, name in (tried or named).items():
        rows = read_trials(out / name, motions)
        rows = rows[rows["robot"] == "declared"]
        last = pd.read_csv(out / name / CURVE).tail(10).mean()
        for split, which in SPLITS.items():
            own = rows[rows["split"] == split]
            cells = [told, which, str(own["motion"].nunique())]
            cells += [cell(rate(own, "success"), 2), cell(rate(own, "success_upright"), 2)]
            cells += [cell(estimate(own, "mpkpe_mm"), 0), f"{last['reward']:.3f}", f"{last['action_std']:.2f}"]
            lines.append(line([*cells, f"{0.02 * last['episode_length']:.1f}"]))
    return "\n".join(lines) + "\n"
