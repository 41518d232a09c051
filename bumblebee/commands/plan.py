"""Command line: `bumblebee plan`."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bumblebee.commands.model import by_joint
from bumblebee.errors import BadInput, plain

if TYPE_CHECKING:
    from bumblebee.diagnosis.plan import Plan, PlanConfig

Model = Annotated[Path, typer.Argument(metavar="MODEL.xml", help="The declared (nominal) MJCF.")]
Data = Annotated[Path | None, typer.Argument(metavar="DATASET", help="Folder that holds rollouts/*.parquet.")]


def plan(
    model: Model,
    dataset: Data = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for the plan.")] = Path("plan"),
    diagnosis: Annotated[
        Path | None, typer.Option("--diagnosis", help="Folder that `bumblebee diagnose` wrote for DATASET.")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, max=40, help="Runs of the plan.")] = 4,
    seconds: Annotated[float, typer.Option(help="Length of a run with its rests.")] = 8.0,
    rate: Annotated[float | None, typer.Option(help="Rate of the targets in Hz; the dataset's, or 50.")] = None,
    gains: Annotated[str, typer.Option(help="Factors on kp that the robot can be set to, as 0.5,1,2.")] = "1",
    damping: Annotated[str, typer.Option(help="Factors on kd that the robot can be set to besides, as 0.3.")] = "",
    speed: Annotated[
        list[str] | None, typer.Option(metavar="[JOINT=]VALUE", help="Speed limit in rad/s or m/s; repeat for joints.")
    ] = None,
    torque: Annotated[
        list[str] | None,
        typer.Option(metavar="[JOINT=]VALUE", help="Torque limit in N m or N, if the model has none."),
    ] = None,
    travel: Annotated[
        list[str] | None, typer.Option(metavar="[JOINT=]VALUE", help="Travel to either side of the start in rad or m.")
    ] = None,
    start: Annotated[str | None, typer.Option(help="Keyframe that runs start and end in.")] = None,
    kp: Annotated[float | None, typer.Option(help="kp of the servo that tracks targets on torque drives.")] = None,
    kd: Annotated[float | None, typer.Option(help="kd of that servo.")] = None,
    pool: Annotated[int, typer.Option(min=4, max=1000, help="Candidate motions to choose from.")] = 48,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the candidate motions.")] = 0,
    minutes: Annotated[
        float | None, typer.Option(min=0.01, help="Time for the whole of it; of the candidates as many as it leaves.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier plan.")] = False,
) -> None:
    """Runs for the robot that tell apart what a diagnosis could not, within all limits, with a run sheet.

    With --minutes, Ctrl-C or SIGTERM ends the search, and runs are chosen from the candidates that were looked at.
    """
    from bumblebee.diagnosis.plan import PlanConfig, summary, write_plan
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    _claim(model, dataset, diagnosis, out, overwrite)
    config = PlanConfig(
        runs=runs, seconds=seconds, rate=rate, gains=_numbers("--gains", gains),
        damping=_numbers("--damping", damping) if damping else (), pool=pool, seed=seed, start=start,
        speed=by_joint("--speed", speed), torque=by_joint("--torque", torque),
        travel=by_joint("--travel", travel), kp=kp, kd=kd,
    )  # fmt: skip
    told = write_plan(_made(model, dataset, diagnosis, config, minutes), out, overwrite)
    print(plain(summary(told)))
    print(f"written: {out / 'plan.json'}, sheet.html, runs/*.csv, runs/*.parquet")


def _claim(model: Path, dataset: Path | None, diagnosis: Path | None, out: Path, overwrite: bool) -> None:
    """See before the work that `out` can be written, and that a dataset came with its diagnosis or neither."""
    from bumblebee.diagnosis.places import inputs_of, model_files
    from bumblebee.diagnosis.plan import claim_plan

    inputs = model_files(model) if dataset is None else inputs_of(model, dataset)
    claim_plan(out, overwrite, [*inputs, *([diagnosis] if diagnosis else [])])
    if (dataset is None) != (diagnosis is None):
        raise BadInput(
            "--diagnosis" if diagnosis is None else "DATASET",
            "a dataset and the diagnosis of it, or neither",
            "a dataset alone" if diagnosis is None else "a diagnosis alone",
            "Run `bumblebee diagnose MODEL.xml DATASET --out FOUND`, then plan with DATASET --diagnosis FOUND.",
        )


def _made(
    model: Path, dataset: Path | None, diagnosis: Path | None, config: "PlanConfig", minutes: float | None
) -> "Plan":
    """Read what there is and plan, with a line a step; in some minutes, or until a signal asks for the end."""
    from bumblebee.diagnosis.dataset import open_session
    from bumblebee.diagnosis.plan import make_plan, read_findings
    from bumblebee.diagnosis.simulation import Stop
    from bumblebee.first_signal import first_signal
    from bumblebee.measured.model_file import load_spec

    stop = Stop() if minutes is None else Stop(minutes)

    def say(text: str) -> None:
        print(plain(f"[{time.monotonic() - stop.began:5.1f} s] {text}"), flush=True)

    def ask() -> bool:
        stop.asked = True
        return stop.searching

    findings = read_findings(diagnosis) if diagnosis else None
    with first_signal(ask):
        session = open_session(model, dataset, config.thresholds.dataset) if dataset else None
        return make_plan(load_spec(model), model.name, config, session, findings, say, stop)


def _numbers(option: str, text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise BadInput(option, "numbers with commas between them", repr(text)[:80]) from None
