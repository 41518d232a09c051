"""Command line: `bumblebee model from-urdf`."""

from pathlib import Path
from typing import Annotated

import typer

from bumblebee.errors import BadInput, plain

app = typer.Typer(help="Make a model to diagnose.", no_args_is_help=True, add_completion=False)


@app.callback()
def model() -> None:
    """Make a model to diagnose."""


@app.command("from-urdf")
def from_urdf(
    urdf: Annotated[Path, typer.Argument(metavar="ROBOT.urdf", help="The robot's URDF.")],
    joints: Annotated[str, typer.Option("--joints", help="Joints of the log, with commas; others are held still.")],
    out: Annotated[Path, typer.Option("--out", help="New file for the MJCF.")],
    drive: Annotated[str, typer.Option("--drive", help="Commands in the log: position or torque.")],
    kp: Annotated[
        list[str] | None,
        typer.Option(
            "--kp", metavar="VALUE", help="Position gain in N m/rad or N/m, or JOINT=VALUE; repeat for joints."
        ),
    ] = None,
    kv: Annotated[
        list[str] | None,
        typer.Option("--kv", metavar="VALUE", help="Damping gain in N m s/rad or N s/m, or JOINT=VALUE; repeat."),
    ] = None,
) -> None:
    """Make of a URDF an MJCF that loads, with a drive a logged joint; prints what was mended."""
    from bumblebee.io.write import refuse_existing, try_output, write_file
    from bumblebee.measured.urdf import Drives, from_urdf

    refuse_existing(out)
    try_output(out)
    names = [name.strip() for name in joints.split(",") if name.strip()]
    made = from_urdf(urdf, names, Drives(drive, by_joint("--kp", kp), by_joint("--kv", kv)))
    write_file(out, made.xml)
    print(plain("\n".join(f"note: {note}" for note in made.notes)) or "nothing had to be mended")
    print(plain(f"written: {out}, {len(names)} joints with a {drive} drive each"))


def by_joint(option: str, texts: list[str] | None) -> dict[str, float]:
    """`elbow=2`, or `2` for all others (joint "")."""
    out: dict[str, float] = {}
    for text in texts or ():
        name, _, value = text.rpartition("=")
        try:
            out[name] = float(value)
        except ValueError:
            raise BadInput(option, "VALUE or JOINT=VALUE", repr(text)[:80]) from None
    return out
