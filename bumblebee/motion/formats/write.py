"""Writes clips in the formats of other trainers: G1 CSV, ASAP pickle, mjlab `.npz`; whole files or none."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np

from bumblebee import quaternions
from bumblebee.io.write import write_file
from bumblebee.motion.clip import Clip, velocities
from bumblebee.motion.formats.body_motion import body_motion
from bumblebee.robot.facts import joint_names, joints

_EXTENDED = 3  # bodies without a joint at the end of ASAP's `pose_aa`: both hands and the head


def g1_csv(clip: Clip, every: bool = True) -> bytes:
    """Rows of xyz [m], quaternion xyzw and 29 joints [rad] in Unitree's order, wrists 0; no header, no rate.

    Args:
        clip: the motion.
        every: with the joints that are held still here, at 0; else those that are actuated alone.
    """
    table = np.concatenate(
        [clip.root_pos, clip.root_quat[:, [1, 2, 3, 0]], wide(clip.joint_pos) if every else clip.joint_pos], axis=1
    )
    stream = io.StringIO()
    np.savetxt(stream, table, fmt="%.9g", delimiter=",")  # nine digits are a float32, bit for bit
    return stream.getvalue().encode()


def asap_pickle(clip: Clip) -> bytes:
    """A joblib pickle as ASAP's motion library loads it: one dict in a dict by the file's name.

    `root_trans_offset` (T, 3) [m], `root_rot` (T, 4) [xyzw], `dof` (T, 23) [rad], `pose_aa` (T, 27, 3): rotation
    vectors of the root, the 23 joints and three bodies without one, `fps`.
    """
    pose = np.zeros((clip.frames, 1 + len(joint_names()) + _EXTENDED, 3), np.float32)
    pose[:, 0] = quaternions.rotation_vector(quaternions.normalised(clip.root_quat.astype(np.float64)))
    pose[:, 1 : 1 + len(joint_names())] = clip.joint_pos[:, :, None] * np.array([j.axis for j in joints()])
    motion = {
        "root_trans_offset": clip.root_pos,
        "pose_aa": pose,
        "dof": clip.joint_pos,
        "root_rot": np.ascontiguousarray(clip.root_quat[:, [1, 2, 3, 0]]),
        "fps": int(clip.fps) if clip.fps == int(clip.fps) else clip.fps,
    }
    stream = io.BytesIO()
    joblib.dump({asap_stem(clip): motion}, stream)
    return stream.getvalue()


def asap_stem(clip: Clip) -> str:
    """The name of an ASAP file, under which it also keeps its motion: ASAP takes a file's name up to its first dot."""
    return clip.name.replace(".", "_")


def mjlab_npz(clip: Clip) -> bytes:
    """The arrays that mjlab's motion loader takes, joints and bodies depth-first as in its MJCF of the G1, wrists 0.

    `fps` (1,), `joint_pos` and `joint_vel` (T, 29) [rad, rad/s], `body_pos_w` (T, 30, 3) [m], `body_quat_w`
    (T, 30, 4) [wxyz], `body_lin_vel_w` [m/s] and `body_ang_vel_w` [rad/s] (T, 30, 3). mjlab plays a frame each step of
    its policy, whatever `fps` says: its own environment steps at 50 Hz.
    """
    bodies = body_motion(clip)
    arrays = {
        "joint_pos": wide(clip.joint_pos),
        "joint_vel": wide(velocities(clip).joint_vel),
        "body_pos_w": bodies.pos,
        "body_quat_w": bodies.quat,
        "body_lin_vel_w": bodies.lin_vel,
        "body_ang_vel_w": bodies.ang_vel,
    }
    # The root exactly as the clip has it: kinematics scales the quaternion to length 1 once more.
    arrays["body_quat_w"][:, 0] = clip.root_quat
    stream = io.BytesIO()
    content: dict[str, Any] = {key: np.asarray(values, np.float32) for key, values in arrays.items()}
    np.savez(stream, fps=np.array([clip.fps]), **content)
    return stream.getvalue()


def wide(values: np.ndarray) -> np.ndarray:
    """(T, J) values of the actuated joints as those of every joint, 0 for the ones held still (the G1's wrists)."""
    every = joint_names(every=True)
    out = np.zeros((len(values), len(every)), values.dtype)
    out[:, [every.index(name) for name in joint_names()]] = values
    return out


@dataclass(frozen=True)
class Format:
    """A format that can be written."""

    suffix: str
    content: Callable[[Clip], bytes]
    stem: Callable[[Clip], str] = lambda clip: clip.name
    fps: float | None = None
    """The rate that its readers take for granted [Hz]; None: any."""
    holds_rate: bool = True
    """Whether the file says its rate."""


FORMATS = {
    "g1_csv": Format(".csv", g1_csv, holds_rate=False),
    "asap": Format(".pkl", asap_pickle, asap_stem),
    "mjlab": Format(".npz", mjlab_npz, fps=50.0),
}


def write_motion(folder: Path, clip: Clip, kind: str) -> Path:
    """Write one clip into a folder, whole or not at all; the file's path.

    Args:
        folder: made where it is missing; a file of that name is replaced.
        clip: the motion.
        kind: one of `FORMATS`.
    """
    chosen = FORMATS[kind]
    path = Path(folder) / f"{chosen.stem(clip)}{chosen.suffix}"
    write_file(path, chosen.content(clip))
    return path
