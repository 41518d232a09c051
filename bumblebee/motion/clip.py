"""A motion of the robot as arrays, and what follows from them: velocities, and whether it travels."""

from dataclasses import dataclass

import numpy as np

from bumblebee import quaternions

TRAVELS = 1.0
"""Horizontal distance from its start that the root of a motion which counts as walking reaches [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class Clip:
    """One motion of the G1, sampled evenly; arrays are float32; two clips are equal only if they are one object.

    `root_pos` (T, 3) [m, world], `root_quat` (T, 4) [wxyz, body to world], `joint_pos` (T, 23) [rad] in the order of
    `joint_names()`, `key_pos` (T, 14, 3) [m, world] of `KEY_BODIES` by forward kinematics.
    """

    name: str
    fps: float
    root_pos: np.ndarray
    root_quat: np.ndarray
    joint_pos: np.ndarray
    key_pos: np.ndarray
    captions: tuple[str, ...] = ()
    """Lines of HumanML3D: `caption#tokens/POS#from#to`, seconds."""
    source: str = ""
    """The file or generator that it comes from."""
    licence: str = ""
    """Licence of the source, "unknown" where none was found."""
    sha256: str = ""
    """Hash of the source file; of the arrays if the clip was made."""
    family: str = ""
    """Kind of motion: stand, squat, walk, jump ...; "" if unknown."""
    split: str = "train"
    """"train", or "test" if held out."""
    caption_source: str = ""
    """Where the captions come from: "file" (beside the motion), "csv" (the user's table), "humanml3d", "made" (with the
    motion), "name" (words of the file's name, which are no text in any evidence); "" without captions."""

    @property
    def frames(self) -> int:
        """Number of samples T."""
        return len(self.root_pos)

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return (self.frames - 1) / self.fps

    def __repr__(self) -> str:
        kind = f", {self.family}" if self.family else ""
        return f"<Clip {self.name!r}: {self.duration:.1f} s at {self.fps:g} Hz, {self.joint_pos.shape[1]} joints{kind}>"


@dataclass(frozen=True)
class ClipVelocities:
    """Velocities by central differences, float32.

    `root_lin_vel_w` (T, 3) [m/s], `root_ang_vel_b` (T, 3) [rad/s], `joint_vel` (T, 23) [rad/s].
    """

    root_lin_vel_w: np.ndarray
    root_ang_vel_b: np.ndarray
    joint_vel: np.ndarray


def velocities(clip: Clip) -> ClipVelocities:
    """Central differences of a clip; one-sided at both ends, zero if there is one frame only."""
    return ClipVelocities(
        differences(clip.root_pos, clip.fps),
        angular_velocity(clip.root_quat, clip.fps).astype(np.float32),
        differences(clip.joint_pos, clip.fps),
    )


def displacement(clip: Clip) -> float:
    """Largest horizontal distance of the root from where it starts [m]; a closed circle is not zero."""
    return float(np.linalg.norm(clip.root_pos[:, :2] - clip.root_pos[0, :2], axis=-1).max())


def travels(clip: Clip) -> bool:
    """Whether a motion counts as walking, whatever it is called: it goes somewhere, and not only turns or marches."""
    return displacement(clip) >= TRAVELS


def differences(values: np.ndarray, fps: float) -> np.ndarray:
    """Central differences of (T, ...) over time, float32, per second."""
    if len(values) < 2:
        return np.zeros_like(values, dtype=np.float32)
    return (np.gradient(values.astype(np.float64), axis=0) * fps).astype(np.float32)


def angular_velocity(quat: np.ndarray, fps: float) -> np.ndarray:
    """Central differences of the rotation (T, 4), in the body's own frame: (T, 3) [rad/s]."""
    quat = quaternions.normalised(quat.astype(np.float64))
    before = np.maximum(np.arange(len(quat)) - 1, 0)
    after = np.minimum(np.arange(len(quat)) + 1, len(quat) - 1)
    turn = quaternions.rotation_vector(quaternions.multiply(quaternions.conjugate(quat[before]), quat[after]))
    return turn * fps / np.maximum(after - before, 1)[:, None]


def clip_states(clip: Clip) -> np.ndarray:
    """(F, 30) states of the G1 from a clip."""
    return np.concatenate([clip.root_pos, clip.root_quat, clip.joint_pos], axis=1).astype(np.float64)
