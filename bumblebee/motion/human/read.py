"""Reads a motion of a person from a file's bytes: BVH or SMPL .npz, brought to landmarks in metres with z up."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.human.bvh import Bvh, parse_bvh
from bumblebee.motion.human.floor import bad_start, on_floor
from bumblebee.motion.human.forward import adds_positions, rest_positions
from bumblebee.motion.human.frame import (
    ask_up,
    find_unit,
    find_up,
    leg_length,
    require_right_handed,
    standing_axis,
    upright_axis,
    z_up,
)
from bumblebee.motion.human.motion import HumanMotion, Role
from bumblebee.motion.human.npz import npz_keys
from bumblebee.motion.human.skeleton import find_skeleton
from bumblebee.motion.human.skeleton_file import Stated
from bumblebee.motion.human.smpl import is_smpl, read_smpl
from bumblebee.ranges import Range, Ranged

SUFFIXES = (".bvh", ".npz")
_FAR = 1000.0  # m from the origin: beyond is damage


@dataclass(frozen=True)
class HumanConfig(Ranged):
    """Settings that a file of human motion does not say, for those of which the body does not tell it either."""

    unit: Literal["", "m", "dm", "cm", "mm", "inch", "cmu"] = ""
    """Unit of BVH files; empty: by the length of the legs. `cmu` is 1 / 0.45 inch."""
    up: Literal["", "x", "y", "z", "-x", "-y", "-z"] = ""
    """The up axis; empty: BVH's by the body, that of SMPL files z, where the body stands so."""
    fps: Annotated[float, Range(least=0, most=1000)] = 0.0
    """Frame rate of SMPL files that state none; 0: such a file is refused [Hz]."""
    skeleton: Stated | None = None
    """Which joint of a BVH file is which landmark; None: recognised by tree, lengths and names."""


def read_human(path: Path, data: bytes, options: HumanConfig | None = None) -> list[HumanMotion]:
    """The motions of a file, of suffix .bvh or .npz.

    Args:
        path: as it is shown; its stem names the motion.
        data: the file's bytes.
        options: what the file does not say.

    Raises:
        BadInput: one line about what cannot be used, or must be stated.
    """
    options = options or HumanConfig()
    roles: tuple[Role, ...] = ()
    if path.suffix.lower() == ".bvh":
        fps, positions, notes, roles = _from_bvh(path, data, options)
    elif is_smpl(npz_keys(path, data)):
        fps, positions, notes = _from_smpl(path, data, options)
    else:
        raise BadInput(path, "poses and trans, as AMASS's files have them", "an .npz file without them")
    if not (np.abs(positions) < _FAR).all():
        raise BadInput(path, f"a person within {_FAR:g} m of the origin", "one farther away")
    cut = bad_start(positions, fps)
    if cut:
        off = float(np.linalg.norm(positions[cut] - positions[0], axis=1).mean())
        positions = positions[cut:]
        notes += (f"{cut} frame{'s' * (cut > 1)} at the start cut: {off:.2f} m off the motion that follows at once",)
    if len(positions) < 2:
        raise BadInput(path, "a motion of at least 2 frames", f"{len(positions)}")
    require_right_handed(path, positions)
    positions, floor = on_floor(positions, fps)
    notes = (*notes, *floor)
    return [HumanMotion(path.stem, fps, positions, path, first_row=1 + cut, notes=notes, skeleton=roles)]


def _from_bvh(
    path: Path, data: bytes, options: HumanConfig
) -> tuple[float, np.ndarray, tuple[str, ...], tuple[Role, ...]]:
    """Frame rate, positions (T, 18, 3) [m, z up], notes and the skeleton's roles."""
    bvh = parse_bvh(path, data)
    found = find_skeleton(path, bvh, options.skeleton)
    metres, by_legs = find_unit(path, leg_length(found.places), options.unit)
    resting = standing_axis(rest_positions(bvh, found.joints))
    up, by_body = find_up(path, upright_axis(found.places), resting, options.up)
    notes = (f"skeleton: {found.note}", *by_legs, *by_body, *_added(bvh))
    return bvh.fps, z_up(metres * found.places, up), notes, found.roles


def _added(bvh: Bvh) -> tuple[str, ...]:
    """The file's notes, and one on joints whose positions were taken as added to their offsets."""
    names = [bvh.names[joint] for joint in range(len(bvh.names)) if adds_positions(bvh, joint)]
    return (*bvh.notes, *([f"positions of {len(names)} joints are near 0: added to their OFFSET"] if names else []))


def _from_smpl(path: Path, data: bytes, options: HumanConfig) -> tuple[float, np.ndarray, tuple[str, ...]]:
    """Frame rate, positions and notes of an SMPL file: z is up as in AMASS's, or asked for where the body lies."""
    motion = read_smpl(path, data, options.fps)
    shown = upright_axis(motion.positions)
    if shown != "z" and not options.up:
        came = f"a person who stands along {shown or 'no axis'}: another axis is up, or the person lies"
        raise BadInput(path, "z up, as AMASS has it", came, ask_up(*filter(None, [shown])))
    return motion.fps, z_up(motion.positions, options.up or "z"), motion.notes
