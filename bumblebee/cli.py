"""Entry point of `bumblebee`, and its commands `import`, `gap`, `diagnose`, `replay`, `compensate`.

Status 0: done, 2: unusable input or output, 1: an internal error; one line on standard error each.
"""

import os
import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from bumblebee import __version__
from bumblebee.commands.table import COMMANDS, Commands, missing
from bumblebee.errors import EXIT_BAD_INPUT, BadInput, plain
from bumblebee.io.there import require_logs
from bumblebee.last_line import EXIT_INTERRUPTED, guarded
from bumblebee.ranges import Unfit
from bumblebee.robot.which import VARIABLE, path_of
from bumblebee.teller import Teller

_EPILOG = "`bumblebee COMMAND --help` explains a command; docs/commands.md has an example of each."
# Plain text for the list of commands: importing `rich` would take longer than all the rest of it.
app = typer.Typer(
    cls=Commands, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None, epilog=_EPILOG
)
_UNUSABLE: type[Exception] = typer.BadParameter.__bases__[0]  # the library's UsageError, which it does not export

Model = Annotated[Path, typer.Argument(metavar="MODEL.xml", help="The declared (nominal) MJCF.")]
Data = Annotated[Path, typer.Argument(metavar="DATASET", help="Folder that holds rollouts/*.parquet.")]
Minutes = Annotated[
    float | None,
    typer.Option(
        min=0.1, max=10_000, help="Minutes for all of it; the search ends when what is left is needed for the end."
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier result of this command.")]


def _version(wanted: bool) -> None:
    if wanted:
        print(f"bumblebee {__version__}")
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    robot: Annotated[
        str, typer.Option("--robot", help="A robot's folder, or one of `bumblebee robot list`; by default the G1.")
    ] = "",
) -> None:
    """From motion capture to a humanoid's policy, and from the robot's logs back to the simulator."""
    if robot:
        path_of(robot)  # refused here, chosen before (`_choose_robot`)


def diagnose(
    model: Model,
    dataset: Data,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for the diagnosis.")] = None,
    overwrite: Overwrite = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="A first look: `gap`, then the best leads; writes nothing.")
    ] = False,
    held: Annotated[
        str | None, typer.Option("--hold-out", help="Rollouts that take no part: NAME=VALUE[,VALUE] of a condition.")
    ] = None,
    max_windows: Annotated[
        int | None, typer.Option(min=8, help="Windows that take part in the fit; 120, and 40 with --quick.")
    ] = None,
    minutes: Minutes = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the perturbed starts.")] = 0,
) -> None:
    """Find which effect the model lacks, add it, and report the error before and after.

    Ctrl-C, or SIGTERM, ends the search and writes what it has found; a second one ends the process.
    """
    require_logs(model, dataset)
    from bumblebee.diagnosis.config import DiagnosisConfig
    from bumblebee.diagnosis.dataset import open_session, read_held_out
    from bumblebee.diagnosis.diagnose import diagnose
    from bumblebee.diagnosis.output import write_diagnosis
    from bumblebee.diagnosis.places import DIAGNOSIS, claim_folder, inputs_of
    from bumblebee.diagnosis.report import examples, plot, summary
    from bumblebee.diagnosis.simulation import Stop
    from bumblebee.first_signal import first_signal
    from bumblebee.report.replays.windows import windows_inlay
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    if quick:
        if out is not None:
            raise BadInput("--out", "no folder with --quick, which writes nothing", str(out))
        _first_look(model, dataset, held, max_windows, seed)
        return
    if out is None:
        raise BadInput("--out", "a folder for the diagnosis, or --quick", "neither")
    held_out = read_held_out(held) if held else None
    claim_folder(out, DIAGNOSIS, overwrite, inputs_of(model, dataset))
    config = DiagnosisConfig(seed=seed) if max_windows is None else DiagnosisConfig(seed=seed, max_windows=max_windows)
    stop = Stop() if minutes is None else Stop(minutes)
    with Teller() as say:

        def ask() -> bool:
            stop.asked = True
            if stop.searching:
                say("ending the search; what was found by now is fitted and written (a second signal ends it all)")
            return stop.searching

        with first_signal(ask):
            session = open_session(model, dataset, config.thresholds.dataset, held_out)
            result = diagnose(session, config, say, stop)
    print(plain(summary(result.document, result.problem.thresholds.report)))  # said first: the disk may fail now
    shown = examples(result.session, result.effects, count=1)
    print(plain(plot(shown[0])) if shown else "", flush=True)
    write_diagnosis(result, out, overwrite, windows_inlay(result.session, result.effects))
    print(f"written: {out / 'diagnosis.json'}, model.xml, effects.yaml, report.html")


def _first_look(model: Path, dataset: Path, held: str | None, max_windows: int | None, seed: int) -> None:
    from bumblebee.diagnosis.config import DiagnosisConfig
    from bumblebee.diagnosis.dataset import open_session, read_held_out
    from bumblebee.diagnosis.quick import QuickConfig, first_look, told

    work = QuickConfig() if max_windows is None else QuickConfig(windows=max_windows)
    session = open_session(model, dataset, None, read_held_out(held) if held else None)
    whole = shlex.join(["bumblebee", "diagnose", str(model), str(dataset), "--out", "found"])
    with Teller() as say:
        seen = first_look(session, DiagnosisConfig(seed=seed), work, say)
    print(plain(told(seen, whole)))


def replay(
    model: Model,
    dataset: Data,
    out: Annotated[Path, typer.Option("--out", help="JSON file for the errors.")],
    effects: Annotated[Path | None, typer.Option("--effects", help="effects.yaml to apply to the model.")] = None,
    overwrite: Overwrite = False,
) -> None:
    """The error of any model on any rollouts, by horizon."""
    from bumblebee.diagnosis.dataset import open_session
    from bumblebee.diagnosis.output import write_errors
    from bumblebee.diagnosis.places import claim_file, inputs_of
    from bumblebee.diagnosis.replay import replay
    from bumblebee.sim.effects import read_effects
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    claim_file(out, overwrite, inputs_of(model, dataset, effects))
    chosen = read_effects(effects) if effects else []
    write_errors(replay(open_session(model, dataset), chosen), out, overwrite)
    print(f"written: {out}")


def gap(
    model: Model,
    dataset: Data,
    out: Annotated[Path | None, typer.Option("--out", help="Also write gap.json and gap.html here.")] = None,
    overwrite: Overwrite = False,
) -> None:
    """Where the model errs before anything is fitted."""
    from bumblebee.diagnosis.dataset import open_session
    from bumblebee.diagnosis.gap import gap as compare
    from bumblebee.diagnosis.output import write_gap
    from bumblebee.diagnosis.places import GAP, claim_folder, inputs_of
    from bumblebee.diagnosis.report import gap_summary
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    if out:
        claim_folder(out, GAP, overwrite, inputs_of(model, dataset))
    report = compare(open_session(model, dataset))
    print(plain(gap_summary(report.document, report.examples, report.thresholds.report)), flush=True)
    if out:
        write_gap(report, out, overwrite)
        print(f"written: {out / 'gap.html'}, gap.json")


def import_(
    source: Annotated[Path, typer.Argument(metavar="SOURCE", help="Folder, zip archive or file of logs.")],
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="New folder for rollouts/*.parquet.")],
    kind: Annotated[
        str, typer.Option("--kind", help="so101, csv, rosbag, lerobot, hdf5, double_pendulum, asap or sysid.")
    ],
    model: Annotated[Path | None, typer.Option("--model", help="The declared MJCF; copied to model.xml.")] = None,
    columns: Annotated[
        Path | None, typer.Option("--columns", help="Map of columns, joints and units, a YAML file.")
    ] = None,
    conditions: Annotated[
        Path | None, typer.Option("--conditions", help="Table of gains, loads, labels ... of each log, CSV or YAML.")
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A condition of all logs; repeat for more.")
    ] = None,
) -> None:
    """Turn logs of another layout into a dataset of the contract."""
    from bumblebee.diagnosis.dataset import refuse_unmatched
    from bumblebee.io.write import refuse_existing, refuse_overlap, try_output
    from bumblebee.measured.importers import import_dataset, notes_of
    from bumblebee.report.wording import plural

    refuse_overlap(dataset, [path for path in (source, model, columns, conditions) if path])
    refuse_existing(dataset)
    try_output(dataset)
    ids = import_dataset(source, kind, dataset, model, columns, conditions, settings or (), refuse_unmatched)
    print(f"{plural(len(ids), 'rollout')}: {', '.join(ids[:6])}{' ...' if len(ids) > 6 else ''}")
    print("\n".join(notes_of(dataset)))


def compensate(
    effects: Annotated[Path, typer.Argument(metavar="EFFECTS.yaml", help="Effects that a diagnosis found.")],
    out: Annotated[Path, typer.Option("--out", help="File for the compensation, JSON.")],
    model: Annotated[
        Path | None,
        typer.Option("--model", help="MJCF of the G1 that the policy was trained on; the declared one by default."),
    ] = None,
    leave_out: Annotated[bool, typer.Option("--leave-out", help="Go on without what cannot be undone.")] = False,
    unproven: Annotated[
        bool, typer.Option("--unproven", help="Go on where the diagnosis shows no better model on held-out rollouts.")
    ] = False,
    overwrite: Overwrite = False,
) -> None:
    """List what a policy's runner can undo at the joints of the G1, without training; no other robot has a runner."""
    from bumblebee.compensation.evidence import require_proven
    from bumblebee.compensation.file import claim_compensation, table_of, write_compensation
    from bumblebee.compensation.plan import compensate_file
    from bumblebee.compensation.robot import require_g1

    claim_compensation(out, overwrite, [path for path in (effects, model) if path])
    require_g1(effects, model)
    if not unproven:
        require_proven(effects)
    compensation = compensate_file(effects, model, leave_out=leave_out)
    print(table_of(compensation))
    write_compensation(out, compensation)
    print(f"written: {out}, sha256 {compensation.sha256[:12]}")


def run(arguments: list[str]) -> int:
    """Run one command; what is wrong in its options is said in one line."""
    _choose_robot(arguments)
    command = typer.main.get_command(app)
    try:
        with command.make_context("bumblebee", list(arguments) or ["--help"]) as context:
            command.invoke(context)
    except typer.Exit as end:
        return end.exit_code
    except ModuleNotFoundError as error:
        name = next((word for word in arguments if word in COMMANDS), "")
        if name and (error.name or "").split(".")[0] not in ("bumblebee", "tasks", "flows"):
            raise missing(error, name) from None
        raise
    except Unfit as error:
        option = f"--{error.field.replace('_', '-')}"
        if not any(word.split("=")[0] == option for word in arguments):
            raise
        raise BadInput(option, error.expected, error.came) from None
    except typer.Abort:
        return EXIT_INTERRUPTED
    except _UNUSABLE as error:
        place, text = getattr(error, "ctx", None), getattr(error, "format_message", error.__str__)()
        path = place.command_path if place else "bumblebee"
        print(" ".join(f"{path}: {text} Try '{path} --help'.".split()), file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


def _choose_robot(arguments: list[str]) -> None:
    """Take `--robot` before any command is imported: what is made for a robot is made when it is imported."""
    word, value = [*arguments, "", ""][:2]
    if word.split("=")[0] == "--robot":
        os.environ[VARIABLE] = word.partition("=")[2] or value


def main() -> None:
    """Entry point."""
    raise SystemExit(guarded(lambda: run(sys.argv[1:])))


if __name__ == "__main__":
    main()
