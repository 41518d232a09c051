"""Command line: `bumblebee motions inspect`, `convert`, `retarget`, `play`."""

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bumblebee.commands.files import CsvFps, Settings
from bumblebee.errors import BadInput
from bumblebee.teller import Teller

if TYPE_CHECKING:
    from bumblebee.motion.clip import Clip
    from bumblebee.motion.reading.inspect import Inspected
    from bumblebee.motion.reading.one_file import FileConfig

app = typer.Typer(help="Look at motions, convert them, play them.", no_args_is_help=True)

_NAMED = 8  # motions in a line that asks for one of them
_PROGRESS_EVERY = 10.0  # s between lines that say how far a batch is

Where = Annotated[Path, typer.Argument(metavar="PATH", help="A motion file, a folder, or a motion library.")]
Skeleton = Annotated[
    str, typer.Option("--skeleton", metavar="FILE", help="Which joint of BVH files is which: `inspect` prints it.")
]
Rows = Annotated[int, typer.Option("--rows", min=1, help="Rows of the table at most; all are counted.")]


@app.command()
def inspect(
    path: Where,
    csv_fps: CsvFps = None,
    settings: Settings = None,
    skeleton: Skeleton = "",
    rows: Rows = 200,
) -> None:
    """A table of motions: format, rate and who says it, length, height, captions, licence; bad files one line each."""
    from bumblebee.motion.reading.inspect import Counts, count
    from bumblebee.motion.reading.inspect import inspect as look
    from bumblebee.motion.reading.layouts import Layouts

    options = _options(csv_fps, settings, skeleton)
    shown_rows: list[Inspected] = []
    counts, first, layouts = Counts(), "", Layouts()
    for found in look(path, options):
        counts.add(found)
        for row in found:
            layouts.add(row.skeleton, _place(row.file, path))
            first = first or row.problem
            if row.problem:
                print(_line(f"{_place(row.file, path)}: {row.problem}"))
            if row.name and len(shown_rows) < rows:
                shown_rows.append(row)
    _print_table(shown_rows, path)
    if more := counts.motions - len(shown_rows):
        print(f"... and {count(more, 'more motion')} (--rows)")
    if layout := layouts.text():
        print(layout)
    print(counts)
    if not counts.usable:
        raise BadInput(path, "a motion", f"{count(counts.files, 'file')}, nothing usable; the first: {first}"[:1500])


@app.command()
def convert(
    path: Where,
    out: Annotated[Path, typer.Option("--out", help="New folder for the motions and LICENCES.csv.")],
    to: Annotated[str, typer.Option("--to", help="g1_csv, asap, mjlab or library.")],
    fps: Annotated[float | None, typer.Option("--fps", min=1, max=1000, help="Rate of what is written.")] = None,
    csv_fps: CsvFps = None,
    settings: Settings = None,
    skeleton: Skeleton = "",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what was converted before.")] = False,
) -> None:
    """Write motions in another format; without --fps at their own rate, 50 Hz for mjlab and libraries."""
    from bumblebee.motion.formats.convert import KINDS, LIBRARY, ConvertConfig
    from bumblebee.motion.formats.convert import convert as write
    from bumblebee.motion.formats.write import FORMATS
    from bumblebee.motion.reading.inspect import count

    if to not in KINDS:
        raise BadInput("--to", f"one of {', '.join(KINDS)}", repr(to)[:60])
    config = ConvertConfig(to, fps, _options(csv_fps, settings, skeleton))
    began = time.monotonic()
    done = write(path, out, config, overwrite, lambda line: print(f"skipped: {line}", file=sys.stderr))
    rates = ", ".join(f"{rate:g}" for rate in sorted(done.rates))
    took = time.monotonic() - began
    written = f"{count(done.written, 'motion')} written, {len(done.skipped):,} skipped"
    _print_notes(done.notes)
    print(f"{count(done.files, 'file')}: {written}, in {took:.1f} s")
    print(f"written: {out}, {rates} Hz" + ("" if to == LIBRARY else f"; licences: {out / 'LICENCES.csv'}"))
    if to != LIBRARY and not FORMATS[to].holds_rate:
        print(f"These files hold no rate: LICENCES.csv says {rates} Hz, other programs must be told")
    given = None if to == LIBRARY else FORMATS[to].fps
    if given and fps and fps != given:
        print(
            f"Mind: mjlab plays a frame each step of its policy, {given:g} Hz as it is shipped, whatever the file says."
        )


@app.command()
def retarget(
    path: Where,
    out: Annotated[Path, typer.Option("--out", help="New folder for the motions and LICENCES.csv.")],
    model: Annotated[Path | None, typer.Option("--model", help="MJCF of another humanoid.")] = None,
    mapping: Annotated[Path | None, typer.Option("--mapping", help="Its mapping: docs/data.md.")] = None,
    to: Annotated[str, typer.Option("--to", help="npz or csv.")] = "npz",
    fps: Annotated[float, typer.Option("--fps", min=5, max=1000, help="Rate of what is written.")] = 50.0,
    csv_fps: CsvFps = None,
    settings: Settings = None,
    skeleton: Skeleton = "",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what was written before.")] = False,
) -> None:
    """Put motions of people on any humanoid, one file each with the root's pose and the joints by name."""
    from bumblebee.motion.reading.inspect import count
    from bumblebee.motion.retarget_files import RobotFiles, retarget_files
    from bumblebee.robot.facts import ROBOT

    if to not in ("npz", "csv"):
        raise BadInput("--to", "npz or csv", repr(to)[:60])
    config = RobotFiles(model, mapping, fps, to, _options(csv_fps, settings, skeleton))  # type: ignore[arg-type]
    if model is None and mapping is None:
        print(f"Onto {ROBOT}; `bumblebee motions convert` writes the formats that its trainers read.")
    began = shown = time.monotonic()

    def tell(problem: str, motions: int) -> None:
        nonlocal shown
        if problem:
            print(f"skipped: {problem}", file=sys.stderr)
        if time.monotonic() - shown > _PROGRESS_EVERY:
            shown = time.monotonic()
            print(f"{count(motions, 'motion')} in {shown - began:.0f} s", flush=True)

    done = retarget_files(path, out, config, overwrite, tell)
    written = f"{count(done.written, 'motion')} written, {len(done.skipped):,} skipped"
    _print_notes(done.notes)
    print(f"{count(done.files, 'file')}: {written}, in {time.monotonic() - began:.1f} s")
    print(f"written: {out}, {fps:g} Hz, quaternions wxyz; licences: {out / 'LICENCES.csv'}")


@app.command()
def play(
    path: Where,
    motion: Annotated[str, typer.Option("--motion", help="Which, where there are several: its name.")] = "",
    out: Annotated[
        Path | None, typer.Option("--out", help="film.gif, .webp or .mp4, or film.png for a filmstrip.")
    ] = None,
    seconds: Annotated[tuple[float, float], typer.Option("--seconds", help="From and to: the part that is shown.")] = (
        0.0,
        10.0,
    ),
    panels: Annotated[int, typer.Option("--panels", min=1, max=40, help="Frames of a filmstrip.")] = 8,
    csv_fps: CsvFps = None,
    settings: Settings = None,
    skeleton: Skeleton = "",
) -> None:
    """Show a motion on the robot: in a window, or with --out as a film or a filmstrip."""
    if out is not None:
        _claim_picture(out, path)
    elif not _display():
        raise BadInput("--out", "film.gif or film.png on a machine without a display", "nothing")
    options = _options(csv_fps, settings, skeleton)
    with Teller() as say:
        say(f"reading {path}")
        clip = _chosen(path, motion, options)
        if out is not None:
            from bumblebee.report.films.playback import PlayConfig, write_pictures

            say(f"drawing {clip.name}")
            said = write_pictures(out, clip, PlayConfig(panels=panels, start=seconds[0], end=seconds[1]))
    if out is None:
        _window(clip)
        return
    print(f"{clip.name}: {said}")
    print(f"written: {out}")


def _options(csv_fps: float | None, settings: list[str] | None, skeleton: str = "") -> "FileConfig":
    from bumblebee.motion.reading.one_file import stated

    return stated(settings or [], csv_fps=csv_fps, skeleton=skeleton)


def _print_table(rows: "list[Inspected]", path: Path) -> None:
    """One line a motion."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    if not rows:
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("motion", "file", "format", "frames", "Hz", "s", "root m", "joints", "captions", "licence", "notes"):
        table.add_column(
            name, overflow="fold", justify="right" if name in ("frames", "s", "joints", "captions") else "left"
        )
    for row in rows:
        cells = (
            row.name,
            _place(row.file, path),
            row.format,
            str(row.frames),
            f"{row.fps:g} ({row.rate_from})",
            f"{row.seconds:.1f}",
            f"{row.height[0]:.2f} to {row.height[1]:.2f}",
            str(row.joints or "person"),
            str(row.captions),
            row.licence,
            "; ".join([*(["not usable, see above"] if row.problem else []), *row.notes]),
        )
        table.add_row(*(Text(_line(cell)) for cell in cells))
    wide = None if sys.stdout.isatty() else 200
    Console(width=wide, highlight=False).print(table)


def _print_notes(notes: list[tuple[str, str]]) -> None:
    """Facts that were detected and not stated, in few lines: (place, note) of each motion."""
    from bumblebee.motion.reading.few_lines import said_of

    for line in said_of("noted", notes):
        print(line)


def _place(file: Path, path: Path) -> str:
    from bumblebee.motion.texts import shown

    return shown(os.path.relpath(file, path) if Path(path).is_dir() else str(file))


def _line(text: str) -> str:
    return "".join(sign if sign.isprintable() else "\ufffd" for sign in text)


def _chosen(path: Path, name: str, options: "FileConfig") -> "Clip":
    """The motion of that name at a path, or the only one."""
    from bumblebee.motion.formats.convert import clips_at
    from bumblebee.motion.reading.nothing import nothing

    names: list[str] = []
    reasons: list[tuple[str, str]] = []
    clip = None
    said: list[tuple[str, str]] = []
    for found, notes in clips_at(path, options, lambda *said: reasons.append(said)):
        names.append(found.name)
        if name in ("", found.name):
            clip, said = found, notes
        if (name and clip is not None) or (not name and len(names) > _NAMED):
            break
    if clip is not None and (name or len(names) == 1):
        _print_notes(said)
        return clip
    some = ", ".join(names[:_NAMED]) + (" ..." if len(names) > _NAMED else "")
    if names:
        raise BadInput(path, "the name of one motion", repr(name) if name else "several motions", f"--motion: {some}")
    raise nothing(path, "a motion of the robot", reasons)


def _claim_picture(out: Path, path: Path) -> None:
    from bumblebee.io.write import refuse_existing, refuse_overlap, try_output
    from bumblebee.report.films.film_file import require_film

    refuse_overlap(out, [path])
    require_film(out, (".png",))
    refuse_existing(out)
    try_output(out)


def _display() -> bool:
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _window(clip: "Clip") -> None:
    """Play a clip over and over in MuJoCo's viewer until it is closed."""
    import mujoco
    import mujoco.viewer
    import numpy as np

    from bumblebee.robot.model import build_model

    model = build_model()
    data = mujoco.MjData(model)
    qpos = np.concatenate([clip.root_pos, clip.root_quat, clip.joint_pos], axis=1)
    with mujoco.viewer.launch_passive(model, data) as viewer:
        began = time.monotonic()
        while viewer.is_running():
            row = int((time.monotonic() - began) * clip.fps) % clip.frames
            data.qpos[:] = qpos[row]
            mujoco.mj_forward(model, data)
            viewer.sync()
            time.sleep(1 / clip.fps)
