"""Command line: `bumblebee view`, `bumblebee demo --view`."""

import contextlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bumblebee.errors import BadInput

if TYPE_CHECKING:
    from mujoco import MjSpec

    from bumblebee.view.sources import Entry

PORT = 8765
Port = Annotated[int, typer.Option("--port", min=0, max=65535, help="Port on this machine; 0 takes a free one.")]
Meshes = Annotated[
    Path | None,
    typer.Option("--meshes", help="Folder of Unitree's G1 meshes (*.STL); without, a shape made of primitives."),
]
Ticks = Annotated[int | None, typer.Option("--ticks", hidden=True, help="Rounds of the page's loop, for tests.")]


def register(app: typer.Typer) -> None:
    """Put the commands of this file on a command line."""
    app.command()(view)
    app.command()(demo)


def demo(
    view: Annotated[bool, typer.Option("--view", help="The shipped policy, live in the browser.")] = False,
    port: Port = PORT,
    meshes: Meshes = None,
    ticks: Ticks = None,
) -> None:
    """Play the shipped policy in the browser: no training, no other server."""
    if not view:
        raise BadInput("bumblebee demo", "--view", "nothing", "The whole loop is `make demo`.")
    play_shipped_policy(port, meshes, ticks)


def view(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="Motions, a policy's folder, or measured rollouts.")],
    motions: Annotated[Path | None, typer.Option("--motions", help="What a policy follows; without, ours.")] = None,
    model: Annotated[
        Path | None, typer.Option("--model", help="Declared MJCF that measured rollouts belong to.")
    ] = None,
    effects: Annotated[Path | None, typer.Option("--effects", help="effects.yaml of a diagnosis of them.")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="What files leave unsaid: docs/data.md.")
    ] = None,
    port: Port = PORT,
    meshes: Meshes = None,
    ticks: Ticks = None,
) -> None:
    """Show motions, a policy live, or measured rollouts beside their simulation, in the browser."""
    from bumblebee.motion.one_file import stated
    from bumblebee.view.what import is_dataset, is_policy, motion_entries, policy_entries

    if is_dataset(path):
        declared = model or path / "model.xml"
        if not declared.is_file():
            raise BadInput(path, "the model of these rollouts", "none", "Name its MJCF with --model MODEL.xml.")
        from bumblebee.sim.effects import read_effects
        from bumblebee.view.measured import spec_of, window_entries

        found = window_entries(declared, path, read_effects(effects) if effects else ())
        title = "Measured, and simulated in pale blue" + (" (declared) and green (corrected)" if effects else "")
        _play(found, title, port, meshes, ticks, spec_of(declared))
        return
    if is_policy(path):
        _play(policy_entries(path, motions, stated(settings or [])), f"{path.name}, live", port, meshes, ticks)
        return
    _play(motion_entries(path, stated(settings or [])), f"Motions of {path.name}", port, meshes, ticks)


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
    from bumblebee.report.looks import meshes_of_user
    from bumblebee.view.page import Page
    from bumblebee.view.scene import Picture
    from bumblebee.view.server import address, open_server, show_page

    server = open_server(port)
    try:
        page = Page(Picture(server, meshes_of_user(meshes), make), entries, title)
        print(show_page(address(server)), flush=True)
        page.run(ticks)
    except KeyboardInterrupt:
        return
    finally:
        with contextlib.redirect_stdout(io.StringIO()):  # its own farewell
            server.stop()
