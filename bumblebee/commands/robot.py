"""Command line: `bumblebee robot inspect`, `check`, `list`."""

import os
from pathlib import Path
from typing import Annotated

import typer

from bumblebee.errors import EXIT_BAD_INPUT, BadInput, plain

app = typer.Typer(
    help="Look at a robot's model, and make a robot's folder of it.", no_args_is_help=True, add_completion=False
)

_PAIRS = 20  # of bodies that are listed


@app.callback()
def robot() -> None:
    """Look at a robot's model, and make a robot's folder of it."""


@app.command("list")
def list_() -> None:
    """Print the robots that come along, and which one is chosen."""
    from bumblebee.robot.which import VARIABLE, chosen_name, shipped

    chosen = chosen_name()
    for name in shipped():
        print(f"{name}{'  (chosen)' if name == chosen else ''}")
    if chosen not in shipped():
        print(f"{chosen}  (chosen)")
    print(f"Another: `bumblebee --robot NAME ...`, or {VARIABLE}=NAME; a folder of your own in the place of NAME.")


@app.command()
def check(
    folder: Annotated[
        str | None, typer.Argument(metavar="FOLDER", help="A robot's folder, or a name of `list`.")
    ] = None,
) -> None:
    """Say whether a robot's folder describes a robot that can be trained: nine checks, status 2 if one fails."""
    from bumblebee.robot.which import VARIABLE

    if folder is not None:
        os.environ[VARIABLE] = folder
    from bumblebee.new_robot.check import check as tried
    from bumblebee.robot.facts import ROBOT, joint_names

    findings = tried()
    print(plain(f"{ROBOT}: {len(joint_names())} joints"))
    for one in findings:
        print(plain(f"  {'yes' if one.holds else 'NO '}  {one.name}{'' if one.holds else ': ' + one.found}"))
    if not all(one.holds for one in findings):
        raise typer.Exit(EXIT_BAD_INPUT)


@app.command()
def inspect(
    model: Annotated[
        Path | None, typer.Argument(metavar="MODEL.xml", help="An MJCF; without, the chosen robot.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Write a robot's folder: the model, a first robot.yaml, a picture.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a folder that is there.")] = False,
) -> None:
    """Print joints with their limits and gains, and what can touch what; or write a first folder of a robot."""
    if out is not None:
        from bumblebee.new_robot.first_folder import draft_folder

        if model is None:
            raise BadInput(
                "--out", "the MJCF that the folder is made of", "none", "bumblebee robot inspect MODEL.xml --out FOLDER"
            )
        asked = draft_folder(model, out, overwrite)
        print(plain(f"{out}: robot.yaml, {model.name}, robot.svg. Look at the picture, then tell it:"))
        for question in asked:
            print(plain(f"  {question}"))
        print(plain(f"Then: bumblebee robot check {out}"))
        return
    import mujoco
    import numpy as np

    from bumblebee.measured.model_file import load_spec
    from bumblebee.robot.drives import explicit_drives
    from bumblebee.robot.model import build_spec

    spec, notes = explicit_drives(build_spec() if model is None else load_spec(model))
    made = spec.compile()
    scalar = (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE))
    drives = {int(made.actuator_trnid[i, 0]): i for i in range(made.nu)}
    total = float(made.body_mass.sum())
    print(plain(f"{spec.modelname}: {made.nbody - 1} bodies, {total:.2f} kg, {made.nu} drives, {made.njnt} joints"))
    print(f"{'joint':32} {'range':>17} {'torque':>8} {'kp':>8} {'kd':>7} {'armature':>9}")
    for j in range(made.njnt):
        if int(made.jnt_type[j]) not in scalar:
            continue
        low, high = made.jnt_range[j]
        span = f"{low:8.3f} {high:8.3f}" if made.jnt_limited[j] else "no limit"
        drive = drives.get(j)
        torque, kp, kd = "none", "", ""
        if drive is not None:
            torque = f"{made.actuator_forcerange[drive, 1]:g}" if made.actuator_forcelimited[drive] else "no limit"
            kp, kd = f"{-made.actuator_biasprm[drive, 1]:.4g}", f"{-made.actuator_biasprm[drive, 2]:.4g}"
        armature = made.dof_armature[made.jnt_dofadr[j]]
        print(plain(f"{made.joint(j).name[:32]:32} {span:>17} {torque:>8} {kp:>8} {kd:>7} {armature:9.4g}"))
    kind, affinity = made.geom_contype[:, None], made.geom_conaffinity[None]
    touch = ((kind & affinity) | (kind & affinity).T) != 0
    body = made.geom_bodyid
    pairs = np.argwhere(np.triu(touch & (body[:, None] != body[None]), 1))
    named = sorted({tuple(sorted(made.body(int(body[g])).name for g in pair)) for pair in pairs})
    print(f"{len(pairs)} pairs of shapes can touch, of {len(named)} pairs of bodies; {made.npair} pairs are listed")
    for one, other in named[:_PAIRS]:
        print(plain(f"  {one} - {other}"))
    if len(named) > _PAIRS:
        print(f"  ... and {len(named) - _PAIRS} more")
    for note in notes:
        print(plain(f"noted: {note}"))
