"""Targets for the robot, in its own size, from a person's landmarks."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from bumblebee.motion.grounding import GroundingConfig
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.contacts import foot_points, stance
from bumblebee.motion.retarget.mapping import CORNERS, POINTS, SIDES, Robot
from bumblebee.motion.retarget.tree import points, poses

SEGMENTS = (
    *((f"{side}_{a}", f"{side}_{b}") for side in SIDES for a, b in (("hip", "knee"), ("knee", "ankle"))),
    *((f"{side}_{a}", f"{side}_{b}") for side in SIDES for a, b in (("shoulder", "elbow"), ("elbow", "wrist"))),
    ("right_hip", "left_hip"),
    ("right_shoulder", "left_shoulder"),
)
"""From where to where; the torso, from the middle of the hips to the neck, comes last."""


@dataclass(frozen=True, eq=False)
class Targets:
    """At `fps` over T frames, in the robot's size, world frame with the floor at 0.

    `segments` (T, S + 1, 3) [m]: vectors of `SEGMENTS` and of the torso; `hips` (T, 3) [m]: the middle of the hips;
    `feet` (T, 2, 3) [m]: from heel to toe; `contact` (T, 8) from 0 to 1, of the soles' corners; `frame` (T, 3, 3): the
    pelvis' orientation to start from; `floor` (T,) [m]: how high the floor was under the person; `posture` (T, n)
    [rad]: joint angles to stay near instead of those at rest.
    """

    fps: float
    segments: np.ndarray
    hips: np.ndarray
    feet: np.ndarray
    contact: np.ndarray
    frame: np.ndarray
    floor: np.ndarray
    posture: np.ndarray | None = None

    def part(self, start: int, end: int) -> "Targets":
        """The frames from `start` to before `end`."""
        own, posture = slice(start, end), None if self.posture is None else self.posture[start:end]
        pose = (self.segments[own], self.hips[own], self.feet[own])
        return Targets(self.fps, *pose, self.contact[own], self.frame[own], self.floor[own], posture)

    def near(self, robot: Robot) -> np.ndarray:
        """Joint angles (T, n) [rad] that a robot stays near."""
        return np.tile(robot.rest, (len(self.hips), 1)) if self.posture is None else self.posture


def at_rate(motion: HumanMotion, fps: float, cutoff: float) -> np.ndarray:
    """The landmarks (T', 18, 3) [m], low-passed at their own rate and resampled to `fps`."""
    values, frames = motion.positions, len(motion.positions)
    if motion.fps > 2.2 * cutoff and frames > 2:
        values = sosfiltfilt(butter(2, cutoff, fs=motion.fps, output="sos"), values, axis=0, padlen=min(frames - 1, 30))
    if abs(motion.fps - fps) < 1e-9:
        return np.array(values)
    count = int(np.floor((frames - 1) / motion.fps * fps + 1e-6)) + 1
    at = np.minimum(np.arange(count) * (motion.fps / fps), frames - 1)
    return CubicSpline(np.arange(frames), values)(at)


def targets(positions: np.ndarray, fps: float, robot: Robot, config: RetargetConfig) -> Targets:
    """Targets of a robot from landmarks (T, 18, 3) at the robot's rate."""
    size = config.contact.leg / _leg({name: positions[:, i] for i, name in enumerate(LANDMARKS)})
    stand = stance(positions * size, fps, config.contact, GroundingConfig())
    rest, floor = stand.rest / size, stand.floor / size
    lifted = positions - floor[:, None, None] * np.array([0.0, 0.0, 1.0])
    of = {name: lifted[:, i] for i, name in enumerate(LANDMARKS)}
    sizes = _lengths(robot)
    segments = [_unit(of[b] - of[a]) * size for (a, b), size in zip(SEGMENTS, sizes, strict=False)]
    middle = (of["left_hip"] + of["right_hip"]) / 2
    spine = _unit(of["neck"] - middle)
    segments.append(spine * sizes[-1])
    scale, ankle = _leg_scale(robot, of)
    hips = middle * scale
    hips[:, 2] = (middle[:, 2] - rest[:, 0].mean()) * scale + ankle
    left = _unit(of["left_hip"] - of["right_hip"])
    forward = _unit(np.cross(left, spine))
    frame = np.stack([forward, np.cross(spine, forward), spine], axis=-1)
    feet = _foot_directions(lifted, rest) * np.linalg.norm(robot.sole[2] - robot.sole[0])
    contact = np.repeat(stand.contact, CORNERS // 2, axis=2).reshape(len(positions), -1)
    return Targets(fps, np.stack(segments, axis=1), hips, feet, contact, _orthonormal(frame), floor)


def _lengths(robot: Robot) -> list[float]:
    """Lengths of the robot's segments, the torso's last [m]."""
    at = rest_points(robot)
    middle = (at["left_hip"] + at["right_hip"]) / 2
    return [float(np.linalg.norm(at[b] - at[a])) for a, b in SEGMENTS] + [float(np.linalg.norm(at["neck"] - middle))]


def rest_points(robot: Robot) -> dict[str, np.ndarray]:
    """Where the robot's points lie with the root at the origin and all joints at rest, and the middles of its soles."""
    at = poses(robot.tree, np.zeros((1, 3)), np.eye(3)[None], robot.rest[None])
    where = dict(zip(POINTS, points(at, robot.body, robot.local)[0], strict=True))
    soles = points(at, robot.sole_body, robot.sole)[0].reshape(2, CORNERS, 3)
    return where | {f"{side}_sole": soles[i].mean(axis=0) for i, side in enumerate(SIDES)}


def _leg_scale(robot: Robot, of: dict[str, np.ndarray]) -> tuple[float, float]:
    """The robot's leg over the person's, and the height of the robot's ankle over its sole [m]."""
    at = rest_points(robot)
    ankle = robot.radius + float(np.mean([at[f"{side}_ankle"][2] - at[f"{side}_sole"][2] for side in SIDES]))
    return _leg(at) / _leg(of), ankle


def _leg(where: dict[str, np.ndarray]) -> float:
    """Thigh and shin, each its median over time, mean of both sides [m]."""
    pairs = ((f"{side}_{a}", f"{side}_{b}") for side in SIDES for a, b in (("hip", "knee"), ("knee", "ankle")))
    return float(sum(np.median(np.linalg.norm(where[b] - where[a], axis=-1)) for a, b in pairs)) / len(SIDES)


def _foot_directions(lifted: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """From heel to toe, (T, 2, 3) unit vectors: level where ankle and toe are as high as while they stand."""
    feet = foot_points(lifted)
    along = feet[:, :, 1] - feet[:, :, 0]
    along[..., 2] -= rest[:, 1] - rest[:, 0]
    return _unit(along)


def _orthonormal(frame: np.ndarray) -> np.ndarray:
    """The nearest rotations (T, 3, 3)."""
    u, _, v = np.linalg.svd(frame)
    turn = u @ v
    turn[np.linalg.det(turn) < 0] = np.eye(3)
    return turn


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-9)
