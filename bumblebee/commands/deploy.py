"""Command line: `bumblebee deploy sheet`, `run`, `robot`, `rollouts`."""

import difflib
import getpass
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bumblebee.commands.files import CsvFps
from bumblebee.errors import BadInput, plain

if TYPE_CHECKING:
    from bumblebee.motion.clip import Clip
    from bumblebee.wire.operator.console import Ended

STOPPED = 4
"""Exit status of a run that a safety rule ended."""
app = typer.Typer(add_completion=False, no_args_is_help=True, help="Run a policy on a robot, over a wire.")
_WIRES = "sim (sockets of this machine), lcm, or unitree (its own DDS)."
At = Annotated[str, typer.Option("--at", help="Address of the wire: a folder for sim, a URL for lcm and unitree.")]
Slow = Annotated[
    float, typer.Option("--slow", min=1, max=100, help="Times slower than real time, the same on both sides.")
]


Policy = Annotated[
    str,
    typer.Argument(metavar="POLICY", help="A policy's folder, NAME@ALIAS (registered), or shipped, randomised, imu."),
]
Workspace = Annotated[
    Path, typer.Option("--workspace", help="Folder with .servers, for a registered policy; by default this one.")
]
Motions = Annotated[str, typer.Option("--motions", help="Motion files, or `embedded`.")]
Logs = Annotated[Path, typer.Option("--out", help="Dataset folder; a run adds a journal and a rollout.")]
Bounds = Annotated[Path | None, typer.Option("--limits", help="YAML file of limits; docs/deploy.md.")]


@app.command("sheet")
def sheet(
    policy: Policy,
    clips: Annotated[list[str] | None, typer.Option("--clip", help="A motion to try; repeat it. All without.")] = None,
    motions: Motions = "embedded",
    csv_fps: CsvFps = None,
    robots: Annotated[int, typer.Option("--robots", min=1, max=1000, help="Robots that differ, for each motion.")] = 16,
    minutes: Annotated[float, typer.Option("--minutes", min=0, help="No motion begins after so long.")] = 10.0,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the robots, starts and sensor noise.")] = 0,
    limits: Bounds = None,
    workspace: Workspace = Path(),
    out: Annotated[Path, typer.Option("--out", help="New folder for sheet.html and sheet.json.")] = Path("sheet"),
) -> None:
    """Try motions on robots that differ, in simulation, and order them by risk: what to watch, when to stop."""
    from bumblebee.io.write import refuse_existing, try_output, write_folder
    from bumblebee.policy.exported import ExportedPolicy
    from bumblebee.progress import progress
    from bumblebee.sim.quiet import quiet_mujoco
    from bumblebee.view.sheet_page import sheet_page
    from bumblebee.wire.operator.sheet import make_sheet
    from bumblebee.wire.operator.sheet_file import NAME, as_json, watch
    from bumblebee.wire.safety.limits import Limits, read_limits

    quiet_mujoco()
    refuse_existing(out)
    try_output(out)
    bounds = read_limits(limits) if limits else Limits()
    chosen = _clips(motions, clips or [], csv_fps)
    with _exported(policy, workspace) as folder, progress(len(chosen), "run sheet", "motions") as shown:
        loaded = ExportedPolicy.load(folder)
        made = make_sheet(loaded, chosen, robots, bounds, seed, 60 * minutes, lambda said: shown.update(1, said))
    for one in made.tried:
        print(
            plain(
                f"{one.motion:<20} {100 * one.share:3.0f} % not to the end, tilt {one.tilt_deg:3.0f} deg; {watch(one)}"
            )
        )
    if made.untried:
        print(plain(f"not tried, the time was over: {', '.join(made.untried)}"))
    write_folder(out, {"sheet.html": sheet_page(made), NAME: as_json(made)})
    print(f"written: {out / 'sheet.html'}; for a run: --sheet {out}")


@app.command("run")
def run(
    policy: Policy,
    clip: Annotated[str, typer.Option("--clip", help="Name of the motion to follow.")],
    robot: Annotated[str, typer.Option("--robot", help=_WIRES)] = "sim",
    at: At = "",
    motions: Motions = "embedded",
    csv_fps: CsvFps = None,
    out: Logs = Path("deployed"),
    limits: Bounds = None,
    workspace: Workspace = Path(),
    sheet: Annotated[
        Path | None, typer.Option("--sheet", help="Run sheet; one of another policy, motion or limits is refused.")
    ] = None,
    compensation: Annotated[
        Path | None, typer.Option("--compensation", help="File of `bumblebee compensate`, undone on the way.")
    ] = None,
    page: Annotated[
        int | None,
        typer.Option("--page", min=0, max=65535, help="Show the run on this port of loopback; 0: a free one."),
    ] = None,
    unattended: Annotated[
        bool, typer.Option("--unattended", help="No keys: goes on by itself; simulated robots only.")
    ] = False,
    slow: Slow = 1.0,
    operator: Annotated[str, typer.Option("--operator", help="Who runs it, for the log; your login by default.")] = "",
) -> None:
    """Check robot and policy, stand up slowly, run one clip, damp; the log is a dataset of measured rollouts."""
    from bumblebee.policy.exported import ExportedPolicy
    from bumblebee.view.operator_process import operator_page
    from bumblebee.wire.operator.sheet_file import before_run, read_sheet
    from bumblebee.wire.safety.limits import Limits, read_limits
    from bumblebee.wire.session import Run
    from bumblebee.wire.session import run as go

    bounds = read_limits(limits) if limits else Limits()
    if not unattended:
        _require_keys()
    tried = read_sheet(sheet) if sheet else None
    (chosen,) = _clips(motions, [clip], csv_fps)
    with _exported(policy, workspace) as folder:
        line = before_run(tried, ExportedPolicy.load(folder).sha256, chosen, bounds) if tried else ""
        job = Run(folder, chosen, robot, out, at, compensation, bounds, unattended=unattended, slow=slow,
                  operator=operator or getpass.getuser())  # fmt: skip
        with nullcontext() if page is None else operator_page(page, workspace, _say) as watcher:
            if line:
                _say(line)
            if watcher:
                watcher.show({"run": {"sheet": line}})
            ended, rollout = go(job, _say, watcher)
            _tell(ended, rollout)
            if rollout:
                after = _write_after(ended, rollout, out, workspace)
                if watcher and not unattended:
                    watcher.show({"after": str(after.resolve())})
                    with suppress(EOFError, KeyboardInterrupt):
                        input("The page shows what came; Enter ends it.")
    if ended.reason:
        print(f"stopped by the rule {ended.reason}")
        raise typer.Exit(STOPPED)
    print("ended in good order")


def _say(line: str) -> None:
    print(plain(line), flush=True)


def _tell(ended: "Ended", rollout: Path | None) -> None:
    print("\n".join(ended.numbers.lines(ended.numbers.table())[1:]))
    print(f"guard: {', '.join(ended.told['permitted'])}; refused states: {ended.told['refused'] or 'none'}")
    print(f"written: {rollout}" if rollout else "nothing measured: the policy did not carry the robot", flush=True)


def _write_after(ended: "Ended", rollout: Path, out: Path, workspace: Path) -> Path:
    """Write the page of what came."""
    from bumblebee.io.write import write_file
    from bumblebee.view.after_page import after_page

    after = out / "pages" / f"{rollout.stem}.html"
    counts, missed = dict(ended.numbers.rules.most_common()), ended.numbers.missed
    write_file(after, after_page(ended.reason, counts, missed, rollout, out, workspace))
    _say(f"written: {after}")
    return after


@app.command("robot")
def robot(
    wire: Annotated[str, typer.Option("--wire", help=_WIRES)] = "sim",
    at: At = "",
    sealed: Annotated[Path | None, typer.Option("--sealed", help="File of undeclared effects; none without.")] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of noise, faults and clock.")] = 0,
    delay: Annotated[float, typer.Option("--delay", min=0, help="Delay of each message, both ways [ms].")] = 0.0,
    jitter: Annotated[float, typer.Option("--jitter", min=0, help="Largest further delay, both ways [ms].")] = 0.5,
    dropped: Annotated[float, typer.Option("--dropped", help="Share of messages lost, both ways.")] = 0.0,
    late: Annotated[float, typer.Option("--late", help="Share of messages 50 ms late, both ways.")] = 0.0,
    odometry: Annotated[bool, typer.Option(help="Whether it knows its base's velocity and place.")] = True,
    slow: Slow = 1.0,
    seconds: Annotated[float | None, typer.Option("--seconds", min=0, help="End after so long; else Ctrl-C.")] = None,
) -> None:
    """Be a robot: a simulated one in a gantry, in real time, with IMU, encoders and odometry, until Ctrl-C."""
    from bumblebee.robot.facts import ROBOT as NAME
    from bumblebee.sim.quiet import quiet_mujoco
    from bumblebee.stand_in.sealed import read_sealed
    from bumblebee.wire.links.line import LineFaults
    from bumblebee.wire.realtime import ROBOT, harden
    from bumblebee.wire.robot_end.robot import RobotSettings
    from bumblebee.wire.robot_end.robot_process import require_alone, run_robot

    quiet_mujoco()
    faults = LineFaults(delay / 1e3, jitter / 1e3, dropped, late)
    settings = RobotSettings(seed=seed, odometry=odometry, states=faults, orders=faults)
    effects = read_sealed(sealed) if sealed else []
    require_alone(wire, at)
    harden(ROBOT)
    print(f"a simulated {NAME} on the wire {wire}; Ctrl-C ends it", flush=True)
    made = run_robot(wire, at, effects, settings, slow, seconds, lambda line: print(line, flush=True))
    refused = dict(made.hearing.refused) or "none"
    print(f"orders refused: {refused}; time lost to a busy machine: {made.slipped / 1e9:.2f} s")


@app.command("rollouts")
def rollouts(
    journal: Annotated[Path, typer.Argument(metavar="JOURNAL", help="journals/*.journal of a run that was killed.")],
    out: Annotated[Path, typer.Option("--out", help="Dataset folder that gets the rollout.")],
) -> None:
    """Turn a journal into a measured rollout; `run` does this by itself unless it is killed."""
    from bumblebee.wire.session import write_down

    path = write_down(journal, out)
    if path is None:
        raise BadInput(journal, "a run in which the policy carried the robot", "none", "Run it again.")
    print(f"written: {path}")


def _require_keys() -> None:
    if not sys.stdin.isatty():
        do = "Start it in a terminal, or give --unattended with a simulated robot."
        raise BadInput("bumblebee deploy run", "a terminal, for the dead-man's key", "none", do)


@contextmanager
def _exported(policy: str, workspace: Path) -> Iterator[Path]:
    """Folder of a policy that comes along, of a registered one, or of the user's."""
    from bumblebee.learning import pretrained
    from bumblebee.learning.export import export_shipped
    from bumblebee.wire.policy_end.registered import fetched

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / policy.replace("/", "-")
        if policy in pretrained.SHIPPED:
            yield export_shipped(folder, policy)
        elif "@" in policy and not Path(policy).exists():
            print(plain(fetched(policy, workspace, folder)), flush=True)
            yield folder
        else:
            yield Path(policy)


def _clips(motions: str, names: Sequence[str], csv_fps: float | None) -> "list[Clip]":
    """Motions by their names; all without."""
    from bumblebee.motion.embedded import EmbeddedConfig, make
    from bumblebee.motion.embedded.kinds import kinds
    from bumblebee.motion.reading.folder import read_folder
    from bumblebee.motion.reading.settings import ReadConfig
    from bumblebee.report.wording import plural

    if motions == "embedded":
        made = {kind.name: partial(make, kind, 0, EmbeddedConfig()) for kind in kinds()}
    else:
        read = read_folder(Path(motions), ReadConfig(csv_fps=csv_fps)).clips
        made = {clip.name: partial(lambda clip: clip, clip) for clip in read}
    for name in names:
        if name not in made:
            near = difflib.get_close_matches(name, made, 3) or list(made)[:3]
            known = plural(len(made), "motion")
            raise BadInput("--clip", f"one of {known}", repr(name)[:60], f"Such as {', '.join(near)}.")
    return [made[name]() for name in names or made]
