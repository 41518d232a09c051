"""Command line: `bumblebee view`, and the page of `bumblebee demo --view`."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bumblebee.commands.files import CsvFps, Settings
from bumblebee.errors import BadInput
from bumblebee.learning.pretrained import require_seen

if TYPE_CHECKING:
    from mujoco import MjSpec

    from bumblebee.motion.reading.one_file import FileConfig
    from bumblebee.view.sources import Entry

PORT = 8765
Port = Annotated[
    int, typer.Option("--port", min=0, max=65535, help="Port of the page on this machine; 0 takes a free one.")
]
Meshes = Annotated[
    Path | None,
    typer.Option("--meshes", help="Folder of Unitree's G1 meshes (*.STL); without, a shape made of primitives."),
]
Ticks = Annotated[int | None, typer.Option("--ticks", hidden=True, help="Rounds of the page's loop, for tests.")]


def view(
    path: Annotated[
        Path, typer.Argument(metavar="PATH", help="Motions, a policy or its name, an evaluation, or measured rollouts.")
    ],
    motions: Annotated[Path | None, typer.Option("--motions", help="Motions for a policy; without, ours.")] = None,
    model: Annotated[
        Path | None, typer.Option("--model", help="Declared MJCF that measured rollouts belong to.")
    ] = None,
    effects: Annotated[Path | None, typer.Option("--effects", help="effects.yaml of a diagnosis of them.")] = None,
    csv_fps: CsvFps = None,
    settings: Settings = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Instead write replay.html, or film.gif, .webp or .mp4.")
    ] = None,
    name: Annotated[str, typer.Option("--name", help="Which of several the replay shows: its name.")] = "",
    seconds: Annotated[float, typer.Option("--seconds", min=0.1, max=120, help="Length of the replay at most.")] = 10.0,
    port: Port = PORT,
    meshes: Meshes = None,
    ticks: Ticks = None,
) -> None:
    """Show motions, a policy live, an evaluation, or measured rollouts beside their simulation, in the browser."""
    require_seen(path)
    if out is not None:
        _claim(out, [given for given in (path, motions, model, effects) if given])
    from bumblebee.motion.reading.one_file import stated
    from bumblebee.view.shipped import at_hand

    files = stated(settings or [], csv_fps=csv_fps)
    with at_hand(path) as place:
        entries, title, make = _found(place, motions, model, effects, files)
        if out is None:
            _play(entries, title, port, meshes, ticks, make)
            return
        from bumblebee.report.films.looks import meshes_of_user
        from bumblebee.view.replay import record, write_take
        from bumblebee.view.sources import named

        entry = named(entries, name, path)
        take = record(entry.make(), entry.name, meshes_of_user(meshes), seconds, make)
    size = write_take(out, take)
    print(f"written: {out}, {size / 1e6:.1f} MB; it opens without a server")


def _claim(out: Path, inputs: list[Path]) -> None:
    from bumblebee.io.write import refuse_existing, refuse_overlap, try_output
    from bumblebee.report.films.film_file import require_film

    require_film(out, (".html",))
    refuse_overlap(out, inputs)
    refuse_existing(out)
    try_output(out)


def _found(
    path: Path, motions: Path | None, model: Path | None, effects: Path | None, files: "FileConfig"
) -> "tuple[list[Entry], str, Callable[[], MjSpec] | None]":
    """Find what lies at the path: its entries, the page's title, and the spec of a robot of its own."""
    from bumblebee.view.what import (
        evaluation_entries,
        is_dataset,
        is_evaluation,
        is_policy,
        motion_entries,
        policy_entries,
    )

    if is_evaluation(path):
        return evaluation_entries(path), "An evaluation: the robot, and what it follows in pale blue", None
    if is_dataset(path):
        declared = model or path / "model.xml"
        if not declared.is_file():
            raise BadInput(path, "the model of these rollouts", "none", "Name its MJCF with --model MODEL.xml.")
        from bumblebee.sim.effects import read_effects
        from bumblebee.view.measured import spec_of, window_entries

        entries = window_entries(declared, path, read_effects(effects) if effects else ())
        title = "Measured, and simulated in pale blue" + (" (declared) and green (corrected)" if effects else "")
        return entries, title, spec_of(declared)
    if is_policy(path):
        return policy_entries(path, motions, files, print), f"{path.name}, live", None
    return motion_entries(path, files, print), f"Motions of {path.name}", None


def play_shipped_policy(port: int = PORT, meshes: Path | None = None, ticks: int | None = None) -> None:
    """Show the shipped policy live in the browser until interrupted.

    Args:
        port: TCP port on loopback; 0 for a free one.
        meshes: folder of the G1's meshes; None for primitives.
        ticks: rounds of the page's loop; None for no end.

    Raises:
        BadInput: the port is taken, or the folder holds no meshes.
    """
    from bumblebee.view.server import try_port
    from bumblebee.view.shipped import embedded_entries, shipped_policy

    try_port(port)
    with shipped_policy() as policy:
        _play(embedded_entries(policy), "The shipped policy on the G1, live", port, meshes, ticks)


def _play(
    entries: "list[Entry]",
    title: str,
    port: int,
    meshes: Path | None,
    ticks: int | None,
    make: "Callable[[], MjSpec] | None" = None,
) -> None:
    from bumblebee.report.films.looks import meshes_of_user
    from bumblebee.view.page import Page
    from bumblebee.view.scene import Picture
    from bumblebee.view.server import address, open_server, show_page, stop

    server = open_server(port)
    try:
        page = Page(Picture(server, meshes_of_user(meshes), make), entries, title)
        print(show_page(address(server)), flush=True)
        page.run(ticks)
    except KeyboardInterrupt:
        return
    finally:
        stop(server)
