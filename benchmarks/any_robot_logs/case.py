"""One case: a robot and its logs drawn from a seed, written as a user has them, diagnosed as the command does it."""

import json
import resource
import tempfile
import time
import traceback
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from benchmarks.any_robot_logs.robot import SMALL, Robot, Size, make_robot
from benchmarks.any_robot_logs.truth import Sealed, make_log, record, seal
from benchmarks.any_robot_logs.validate import problems
from bumblebee.diagnosis.config import DiagnosisConfig, SearchConfig
from bumblebee.diagnosis.dataset import open_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.output import write_diagnosis
from bumblebee.diagnosis.simulation import LEFT_OUT, NOT_TRIED
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds, TimeSteps
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout, write_rollout
from bumblebee.report.replays.windows import windows_inlay


@dataclass(frozen=True)
class Budgets:
    """How large the cases are and how long each may be sought."""

    size: Size
    config: DiagnosisConfig


FULL = Budgets(Size(), DiagnosisConfig(search_seconds=120.0, beyond_seconds=40.0))
"""For a job of hours."""
QUICK = Budgets(
    SMALL,
    DiagnosisConfig(
        max_windows=8,
        max_holdout_windows=5,
        max_long_windows=2,
        report_windows=4,
        grow=False,
        search_seconds=0.3,
        beyond_seconds=0.1,
        search=SearchConfig(screen_windows=6, patience=1, simulated=4, trials=2, most=3),
        thresholds=Thresholds(dataset=DatasetThresholds(time_steps=TimeSteps(small_model=0))),
    ),
)
"""For cases of a second or two, searched at steps of 2 ms; model discrepancy is sought in every fifth of them."""


@dataclass(frozen=True)
class Drawn:
    """Robot, logs and truth that a seed stands for."""

    robot: Robot
    rollouts: list[Rollout]
    sealed: list[Sealed]
    about: str


def draw(seed: int, size: Size) -> Drawn:
    """The robot, its logs and what is sealed in them; the same for the same seed and size."""
    rng = np.random.default_rng([19, seed])
    robot = make_robot(rng, size)
    log = make_log(rng, size, len(robot.joints))
    sealed = seal(rng, robot, mujoco.MjModel.from_xml_string(robot.xml))
    rollouts = record(robot, sealed, log, rng)
    return Drawn(robot, rollouts, sealed, ", ".join(robot.about + log.about))


def run_case(seed: int, budgets: Budgets) -> dict[str, Any]:
    """A row: what was drawn, how it ended, whether the document is valid, what was named."""
    began = time.monotonic()
    row: dict[str, Any] = {"seed": seed, "outcome": "done", "text": "", "problems": []}
    try:
        drawn = draw(seed, budgets.size)
        row |= {"about": drawn.about, "sealed": [asdict(s) for s in drawn.sealed]}
        with tempfile.TemporaryDirectory() as folder:
            beyond = budgets is not QUICK or seed % 5 == 0
            row |= _diagnosed(drawn, Path(folder), replace(budgets.config, seed=seed, beyond=beyond))
    except BadInput as error:
        row |= {"outcome": "refused", "text": str(error)}
    except Exception:  # what the benchmark is there to find
        row |= {"outcome": "traceback", "text": traceback.format_exc()[-4000:]}
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return row | {"seconds": round(time.monotonic() - began, 2), "peak_mb": round(peak)}


def _diagnosed(drawn: Drawn, folder: Path, config: DiagnosisConfig) -> dict[str, Any]:
    """Written, read, diagnosed and written, as `bumblebee diagnose` does."""
    model, dataset, out = folder / "model.xml", folder / "dataset", folder / "out"
    model.write_text(drawn.robot.xml)
    (dataset / "rollouts").mkdir(parents=True)
    for rollout in drawn.rollouts:
        write_rollout(dataset / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
    session = open_session(model, dataset, config.thresholds.dataset)
    found = diagnose(session, config)
    write_diagnosis(found, out, replays=windows_inlay(found.session, found.effects))
    document = json.loads((out / "diagnosis.json").read_text())
    mujoco.MjModel.from_xml_path(str(out / "model.xml"))
    named = [{"effect": e["effect"], "where": e["where"]} for e in document["effects"]]
    physical = [n for n in named if n["effect"] != "encoder_quantisation" or "quantised" not in drawn.about]
    sealed = [(s.effect, [s.where]) for s in drawn.sealed]
    return {
        "problems": problems(document),
        "named": named,
        "first_is_sealed": bool(physical) and (physical[0]["effect"], physical[0]["where"]) in sealed,
        "beside_steps": len(physical),
        "unexplained": document["unexplained"]["significant"],
        "set_aside": [s["reason"] for s in document["set_aside"]],
        "failures": [n for n in document["notes"] if n.startswith((LEFT_OUT, NOT_TRIED))],
    }
