"""Command line: `bumblebee import`, `gap`, `diagnose`, `replay`. Status 0: done, 2: unusable input, one line."""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from bumblebee.errors import EXIT_BAD_INPUT, BadInput

app = typer.Typer(help="Close the loop with measured data.", add_completion=False, pretty_exceptions_enable=False)

Model = Annotated[Path, typer.Argument(metavar="MODEL.xml", help="The declared (nominal) MJCF.")]
Data = Annotated[Path, typer.Argument(metavar="DATASET", help="Folder that holds rollouts/*.parquet.")]


@app.callback()
def quiet() -> None:
    """Close the loop with measured data."""
    import mujoco

    # Some of what is tried diverges and is judged so: MuJoCo says no line of it, and writes no MUJOCO_LOG.TXT.
    mujoco.set_mju_user_warning(lambda text: None)


@app.command()
def diagnose(
    model: Model,
    dataset: Data,
    out: Annotated[Path, typer.Option("--out", help="Folder for the diagnosis.")],
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")] = False,
    max_windows: Annotated[int, typer.Option(min=8, help="Windows that take part in the fit.")] = 120,
    seed: Annotated[int, typer.Option(help="Of the perturbed starts.")] = 0,
) -> None:
    """Find which effect the model lacks, add it, and report the error before and after."""
    from bumblebee.diagnosis.config import DiagnosisConfig
    from bumblebee.diagnosis.diagnose import diagnose
    from bumblebee.diagnosis.example import examples
    from bumblebee.diagnosis.output import refuse_existing, write_diagnosis
    from bumblebee.diagnosis.session import open_session
    from bumblebee.diagnosis.terminal import plot, summary

    refuse_existing(out, overwrite)
    session = open_session(model, dataset)
    result = diagnose(session, DiagnosisConfig(max_windows=max_windows, seed=seed), _teller())
    write_diagnosis(result, out, overwrite)
    print(summary(result.document))
    shown = examples(result.session, result.effects, count=1)
    print(plot(shown[0]) if shown else "")
    print(f"written: {out / 'diagnosis.json'}, model.xml, effects.yaml, report.html")


@app.command()
def replay(
    model: Model,
    dataset: Data,
    out: Annotated[Path, typer.Option("--out", help="JSON file for the errors.")],
    effects: Annotated[Path | None, typer.Option("--effects", help="effects.yaml to apply to the model.")] = None,
) -> None:
    """The error of any model on any rollouts, by horizon."""
    from bumblebee.diagnosis.replay import replay, write_json
    from bumblebee.diagnosis.session import open_session
    from bumblebee.sim.effects import read_effects

    chosen = read_effects(effects) if effects else []
    write_json(out, replay(open_session(model, dataset), chosen))
    print(f"written: {out}")


@app.command()
def gap(
    model: Model,
    dataset: Data,
    out: Annotated[Path | None, typer.Option("--out", help="Also write gap.json and gap.html here.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")] = False,
) -> None:
    """Where the model errs before anything is fitted."""
    from bumblebee.diagnosis.gap import gap as compare
    from bumblebee.diagnosis.gap_page import gap_page
    from bumblebee.diagnosis.output import refuse_existing
    from bumblebee.diagnosis.replay import write_json, write_text
    from bumblebee.diagnosis.session import open_session
    from bumblebee.diagnosis.terminal import gap_summary

    if out:
        refuse_existing(out, overwrite)
    report = compare(open_session(model, dataset))
    print(gap_summary(report.document, report.examples))
    if out:
        write_json(out / "gap.json", report.document)
        write_text(out / "gap.html", gap_page(report))
        print(f"written: {out / 'gap.html'}, gap.json")


@app.command(name="import")
def import_(
    source: Annotated[Path, typer.Argument(metavar="SOURCE", help="Folder, zip archive or file of logs.")],
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="New folder for rollouts/*.parquet.")],
    kind: Annotated[str, typer.Option("--kind", help="so101, csv, double_pendulum, asap or sysid.")],
    model: Annotated[Path | None, typer.Option("--model", help="The declared MJCF; copied to model.xml.")] = None,
    columns: Annotated[Path | None, typer.Option("--columns", help="Column map of CSV logs, a YAML file.")] = None,
) -> None:
    """Turn logs of another layout into a dataset of the contract."""
    from bumblebee.measured.importers import import_dataset

    ids = import_dataset(source, kind, dataset, model, columns)
    print(f"{len(ids)} rollouts: {', '.join(ids[:6])}{' ...' if len(ids) > 6 else ''}")


def _teller() -> Callable[[str], None]:
    began = time.monotonic()

    def say(text: str) -> None:
        print(f"[{time.monotonic() - began:5.1f} s] {text}", flush=True)

    return say


def main() -> None:
    """Entry point; bad input ends in one line and status 2."""
    try:
        app()
    except BadInput as error:
        print(error, file=sys.stderr)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
