"""Stage diagnose: what the declared model lacks, from the accepted rollouts of one round."""

from dataclasses import dataclass
from typing import Annotated

import mujoco

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import open_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.output import fill
from bumblebee.diagnosis.report import summary
from bumblebee.ranges import Range, Ranged, Seed
from bumblebee.report.replays.windows import windows_inlay
from tasks.running import paths
from tasks.running.run_form import Metric, milliseconds
from tasks.running.stage import load, log_run, output_folder, run_stage

Windows = Annotated[int, Range(least=8, most=100_000)]


@dataclass(frozen=True)
class DiagnoseConfig(Ranged):
    """Section `diagnose` of params.yaml."""

    max_windows: Windows = 120
    """Windows of 0.2 s that take part in the fit."""
    max_holdout_windows: Windows = 60
    """Held-out windows that acceptance is decided on."""
    report_windows: Windows = 80
    """Windows for each horizon of the error block."""
    search_seconds: Annotated[float, Range(above=0, most=1e6)] = 600.0
    """Processor time after which the search for effects begins nothing new [s], for up to 12 degrees of freedom and in
    proportion longer for more; what was found by then is fitted and reported, and a note says that time ran out."""
    beyond_seconds: Annotated[float, Range(above=0, most=1e6)] = 100.0
    """Processor time of the search for what is in no catalogue [s]."""
    seed: Seed = 0
    """Seed of the perturbed starts."""


def main(round: int) -> None:
    """Diagnose data/measured/r<N> against its declared model into data/diagnosis/r<N>."""
    config = load("diagnose", DiagnoseConfig)
    measured = paths.measured(round)
    mujoco.set_mju_user_warning(lambda text: None)  # what is tried and diverges is judged so, not logged
    diagnosis = DiagnosisConfig(**vars(config))
    session = open_session(measured / "model.xml", measured, diagnosis.thresholds.dataset)
    result = diagnose(session, diagnosis, say=lambda text: print(text, flush=True))
    with output_folder(paths.diagnosis(round)) as folder:
        fill(result, folder, windows_inlay(result.session, result.effects))
    print(summary(result.document, result.problem.thresholds.report))
    log_run("diagnose", round=round, params=config, metrics=_metrics(result.document))


def _metrics(document: dict) -> dict[str, Metric]:
    """Number of effects found, and the joint error [rad] over the horizon [ms]."""
    metrics: dict[str, Metric] = {"effects": float(len(document["effects"]))}
    for part in ("before", "after", "floor"):
        errors = {h: measures["joint_pos_rmse"]["value"] for h, measures in document["error"][part].items()}
        metrics[f"joint_pos_rmse/{part}"] = {milliseconds(h): e for h, e in errors.items() if e is not None}
    return metrics


if __name__ == "__main__":
    run_stage(main)
