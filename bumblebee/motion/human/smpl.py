"""Reads motions of SMPL bodies: AMASS's .npz of SMPL-H and SMPL-X, and the like of SMPL.

`poses` (T, 72, 156 or 165) [rad, axis times angle], or split as `root_orient` and `pose_body`; `trans` (T, 3) [m];
`betas`, `gender`; the frame rate under one of several names. z is up, as AMASS has it: where a body does not stand so,
the up axis is asked for. The pelvis is at `trans` plus its place at rest, which no rotation moves.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import require_real, require_within
from bumblebee.motion.human.bvh import MAX_FRAMES
from bumblebee.motion.human.forward import axis_angle_positions
from bumblebee.motion.human.npz import npz_chosen
from bumblebee.motion.human.smpl_body import GENDERS, PARENTS, find_body
from bumblebee.motion.rates import RATES, rate_in
from bumblebee.motion.reading.remedy import say
from bumblebee.motion.texts import shown

_WIDTHS = {72: "smpl", 156: "smplh", 165: "smplx"}
_NAMES = ("poses", "root_orient", "pose_body", "trans", "betas", "gender", "surface_model_type", *RATES)
_JOINTS = (0, 1, 4, 7, 10, 2, 5, 8, 11, 9, 12, 15, 16, 18, 20, 17, 19, 21)
"""SMPL's joint for each of `LANDMARKS`."""
_BETAS = 400  # at most; AMASS has 10 or 16
_FAR = 1e4  # m, rad: beyond is damage


@dataclass(frozen=True, eq=False)
class Smpl:
    """A motion as its file has it: `positions` (T, 18, 3) [m, the file's axes] of the landmarks."""

    fps: float
    positions: np.ndarray
    notes: tuple[str, ...]


def is_smpl(keys: set[str]) -> bool:
    """Whether a file with arrays of these names is a motion of an SMPL body."""
    return "trans" in keys and ("poses" in keys or {"root_orient", "pose_body"} <= keys)


def read_smpl(path: Path, data: bytes, fps: float = 0.0) -> Smpl:
    """One motion.

    Args:
        path: the file.
        data: its bytes.
        fps: frame rate of a file that states none [Hz]; 0 to ask for it.

    Raises:
        BadInput: an array is missing, of a wrong shape or not finite; no frame rate.
    """
    arrays = npz_chosen(path, data, _NAMES)
    poses, model = _poses(path, arrays)
    trans = _matrix(path, arrays, "trans", (3,))
    if len(trans) != len(poses):
        raise BadInput(path, "as many frames in poses and trans", f"{len(poses)} and {len(trans)}")
    if not 1 <= len(trans) <= MAX_FRAMES:
        raise BadInput(path, f"1 to {MAX_FRAMES:,} frames", f"{len(trans):,}")
    said = _text(arrays, "surface_model_type")
    model = said if said in _WIDTHS.values() else model
    stated, notes = _rate(path, arrays, fps)
    betas = _betas(path, arrays)
    gender = _text(arrays, "gender")
    body = find_body(model, gender if gender in GENDERS else "", betas)
    angles = poses[:, : 3 * len(PARENTS)].reshape(len(poses), len(PARENTS), 3)
    positions = axis_angle_positions(trans + body.offsets[0], angles, body.offsets, PARENTS)
    return Smpl(stated, positions[:, list(_JOINTS)], (*notes, *body.notes))


def _poses(path: Path, arrays: dict[str, np.ndarray]) -> tuple[np.ndarray, str]:
    """Angles of at least the 22 joints of the body, and the model that their number tells."""
    if "poses" in arrays:
        poses = _matrix(path, arrays, "poses", tuple(_WIDTHS))
        return poses, _WIDTHS[poses.shape[1]]
    root, body = _matrix(path, arrays, "root_orient", (3,)), _matrix(path, arrays, "pose_body", (63, 69))
    if len(root) != len(body):
        raise BadInput(path, "as many frames in root_orient and pose_body", f"{len(root)} and {len(body)}")
    return np.concatenate([root, body], axis=1), "smpl" if body.shape[1] == 69 else "smplh"


def _matrix(path: Path, arrays: dict[str, np.ndarray], name: str, widths: tuple[int, ...]) -> np.ndarray:
    where = f"{path}: {name}"
    values = arrays.get(name)
    wanted = f"an array of {' or '.join(map(str, widths))} columns"
    if values is None:
        raise BadInput(where, wanted, "none")
    if values.ndim != 2 or values.shape[1] not in widths:
        raise BadInput(where, wanted, f"shape {values.shape}")
    values = require_real(where, values)
    require_within(where, values, _FAR)
    return values


def _betas(path: Path, arrays: dict[str, np.ndarray]) -> np.ndarray:
    """The shape; that of the first frame where each has its own."""
    if "betas" not in arrays:
        return np.zeros(0)
    betas = arrays["betas"]
    betas = betas[0] if betas.ndim == 2 and len(betas) else betas
    if betas.ndim != 1 or len(betas) > _BETAS:
        raise BadInput(f"{path}: betas", f"a row of at most {_BETAS} numbers", f"shape {arrays['betas'].shape}")
    betas = require_real(f"{path}: betas", betas)
    require_within(f"{path}: betas", betas, _FAR)
    return betas


def _rate(path: Path, arrays: dict[str, np.ndarray], fps: float) -> tuple[float, tuple[str, ...]]:
    rate = rate_in(path, arrays)
    if rate is not None:
        return rate, ()
    if not fps:
        wanted = f"a frame rate ({', '.join(RATES[:3])})"
        raise BadInput(path, wanted, "none", f"AMASS has 120, GVHMR 30. {say({'smpl_fps': 120}, {'smpl_fps': 30})}")
    return fps, (f"{fps:g} Hz, as the settings say",)


def _text(arrays: dict[str, np.ndarray], name: str) -> str:
    """A word, in small letters; "" where there is none."""
    values = arrays.get(name)
    if values is None or values.size != 1 or values.dtype.kind not in "US":
        return ""
    word = values.reshape(-1)[0]
    return shown(word.decode("latin-1") if isinstance(word, bytes) else str(word), 20).strip().lower()
