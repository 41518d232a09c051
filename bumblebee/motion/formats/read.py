"""Which format of robot motion a file has, and its motions: the one function that others call."""

import io
import zipfile
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import npz_arrays
from bumblebee.motion.formats.asap_pickle import JOINT_FIELDS, is_motion, read_asap_pickle, read_fields
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.g1_csv import read_g1_csv
from bumblebee.motion.formats.mjlab_npz import is_mjlab, read_mjlab_npz
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.remedy import say

PICKLES = (".pkl", ".pickle", ".joblib", ".p")
SUFFIXES = (".csv", ".npz", *PICKLES)
"""Suffixes of files that may hold motions of the robot; an `.npz` may also hold one of a person (`is_robot_npz`)."""

__all__ = ["PICKLES", "SUFFIXES", "RobotConfig", "format_of", "is_robot_npz", "read_robot"]


def read_robot(path: Path, data: bytes, options: RobotConfig | None = None) -> list[RawMotion]:
    """The motions of a file that is on the G1 already, at the file's own rate, unchecked (`usable.usable`).

    Args:
        path: the file as it is shown; its suffix and what it holds decide how it is read.
        data: its bytes.
        options: what the file may leave unsaid.

    Raises:
        BadInput: a format that is none of these, a CSV file without `csv_fps`, anything else that is wrong in it.
    """
    options = options or RobotConfig()
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return [_csv(path, data, options)]
    if suffix in PICKLES:
        return read_asap_pickle(path, data, options)
    if suffix == ".npz":
        return _npz(path, npz_arrays(path, data), options)
    raise BadInput(path, f"a motion of the G1 ({', '.join(SUFFIXES)})", f"a file with suffix {suffix[:20]!r}")


def is_robot_npz(data: bytes) -> bool:
    """Whether an `.npz` file's list of arrays is that of a robot's motion; false for SMPL's and for damaged files."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = {name.removesuffix(".npy") for name in archive.namelist()}
    except Exception:  # a damaged list raises anything from BadZipFile to UnicodeDecodeError
        return False
    return not names.isdisjoint({"joint_pos", *JOINT_FIELDS})


def format_of(path: Path) -> str:
    """Name of a file's format in a table."""
    names = {".csv": "G1 CSV", ".npz": "robot .npz", **dict.fromkeys(PICKLES, "pickle")}
    return names.get(path.suffix.lower(), path.suffix.lower().lstrip(".") or "?")


def _csv(path: Path, data: bytes, options: RobotConfig) -> RawMotion:
    if options.csv_fps is None:
        raise BadInput(
            path,
            "a frame rate, which a CSV file does not hold",
            "none",
            "LAFAN1's retargets have 30 Hz, g1_moves 60, BONES-SEED 120; 30 read as 60 makes a walk into a sprint. "
            + say({"csv_fps": 30}),
        )
    return read_g1_csv(path, options.csv_fps, data, options)


def _npz(path: Path, arrays: dict[str, np.ndarray], options: RobotConfig) -> list[RawMotion]:
    if is_mjlab(arrays):
        return [read_mjlab_npz(path, arrays, options)]
    if is_motion(arrays):
        return read_fields(path, arrays, options)
    came = ", ".join(sorted(arrays)[:8])[:160] or "no arrays"
    raise BadInput(path, "joint_pos and body_pos_w (mjlab, BeyondMimic), or root_pos, root_rot and dof_pos", came)
