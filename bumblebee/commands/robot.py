"""Command line: `bumblebee robot inspect`."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="Look at a robot's model.", no_args_is_help=True, add_completion=False)

_PAIRS = 20  # of bodies that are listed


@app.callback()
def robot() -> None:
    """Look at a robot's model."""


@app.command()
def inspect(
    model: Annotated[Path | None, typer.Argument(metavar="MODEL.xml", help="An MJCF; without, the G1.")] = None,
) -> None:
    """Print joints with their limits and gains, and what can touch what."""
    import mujoco
    import numpy as np

    from bumblebee.errors import plain
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
