"""Open measured rollouts and ask what the model lacks."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bumblebee.errors import BadInput

if TYPE_CHECKING:
    from bumblebee.diagnosis.dataset import Session
    from bumblebee.diagnosis.diagnose import Diagnosis
    from bumblebee.diagnosis.plan import Plan
    from bumblebee.sim.effects import Effect


def open_dataset(model: str | Path, dataset: str | Path) -> "Session":
    """Open a declared model with measured rollouts of the robot, checked against each other.

    Args:
        model: the declared MJCF.
        dataset: a folder with `rollouts/*.parquet` as docs/measured-rollout.md says; `bumblebee import` writes one.

    Returns:
        The session that `gap`, `diagnose`, `replay` and `plan` take.

    Raises:
        BadInput: no model, no rollout that can be used, or a convention that is wrong in all of them.
    """
    from bumblebee.diagnosis.dataset import open_session

    return open_session(Path(model), Path(dataset))


def gap(session: "Session") -> dict[str, Any]:
    """Compute where the declared model errs, before anything is fitted.

    Args:
        session: of `open_dataset`.

    Returns:
        The content of `gap.json`: errors by horizon and joint, and what they depend on.

    Raises:
        BadInput: something that is no session.
    """
    from bumblebee.diagnosis.gap import gap as compare
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    return compare(_session(session)).document


def diagnose(
    session: "Session",
    *,
    out: str | Path | None = None,
    seed: int = 0,
    max_windows: int = 120,
    minutes: float = float("inf"),
    say: Callable[[str], None] = lambda text: None,
) -> "Diagnosis":
    """Find which effects the declared model lacks, and how large they are.

    Args:
        session: of `open_dataset`.
        out: a new folder for diagnosis.json, model.xml, effects.yaml and report.html; None writes nothing.
        seed: seed of the perturbed starts.
        max_windows: windows of the fit.
        minutes: time [min]; the search leaves what the last fit and the errors of its effects take.
        say: called with a line for each step.

    Returns:
        `document` (the content of diagnosis.json) and `effects` (for `replay`).

    Raises:
        BadInput: something that is no session, or a folder that exists.
    """
    from bumblebee.diagnosis.config import DiagnosisConfig
    from bumblebee.diagnosis.diagnose import diagnose as find
    from bumblebee.diagnosis.output import write_diagnosis
    from bumblebee.diagnosis.places import DIAGNOSIS, claim_folder
    from bumblebee.diagnosis.simulation import Stop
    from bumblebee.report.replays.windows import windows_inlay
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    if out is not None:
        claim_folder(Path(out), DIAGNOSIS, False, [])
    found = find(_session(session), DiagnosisConfig(seed=seed, max_windows=max_windows), say, Stop(minutes))
    if out is not None:
        write_diagnosis(found, Path(out), False, windows_inlay(found.session, found.effects))
    return found


def replay(session: "Session", effects: "Sequence[Effect]" = ()) -> dict[str, Any]:
    """Compute the error of the declared model with effects on all rollouts, by horizon.

    Args:
        session: of `open_dataset`.
        effects: those of a diagnosis; none for the declared model.

    Returns:
        Horizon [s] -> RMS errors of joints [rad, rad/s] and of the base.

    Raises:
        BadInput: something that is no session, or an effect at a place that the model does not have.
    """
    from bumblebee.diagnosis.replay import replay as compute
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    return compute(_session(session), effects)


def plan(model: str | Path, *, runs: int = 4, seconds: float = 8.0, seed: int = 0) -> "Plan":
    """Plan runs of a robot that excite what a diagnosis must tell apart, within all limits.

    `bumblebee plan` writes them with a run sheet, and takes a dataset and its diagnosis too.

    Args:
        model: the declared MJCF.
        runs: number of runs.
        seconds: length of a run with its rests [s].
        seed: seed of the candidate motions.

    Returns:
        The plan; `bumblebee.diagnosis.plan.write_plan` writes it.

    Raises:
        BadInput: no model, or one without joints that a drive moves.
    """
    from bumblebee.diagnosis.plan import PlanConfig, make_plan
    from bumblebee.measured.model_file import load_spec
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    spec, path = load_spec(Path(model)), Path(model)
    return make_plan(spec, path.name, PlanConfig(runs=runs, seconds=seconds, seed=seed))


def _session(value: Any) -> Any:
    from bumblebee.diagnosis.dataset import Session

    if not isinstance(value, Session):
        do = "Open it with bumblebee.open_dataset(model, dataset)."
        raise BadInput("session", "an open dataset", type(value).__name__, do)
    return value
