"""Excitation of the robots: an arm follows sums of sines and rests, a G1 stands, shifts its weight and moves its arms.

A plan gives the target of every tick from the robot's true state, so that a standing robot can balance.
"""

from pathlib import Path
from typing import Protocol

import numpy as np

from bumblebee.robot.facts import stand_pose
from bumblebee.stand_in.undeclared.declared import Declared

HZ = 50.0


class Plan(Protocol):
    """Commands of R robots over T ticks."""

    ticks: int
    qpos: np.ndarray
    """(R, nq) start."""
    qvel: np.ndarray
    """(R, nv) start."""

    def target(self, tick: int, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """Joint targets (R, J) [rad]."""
        ...


class ArmPlan:
    """Three sines a joint, and rests: for a second in each 2.5 s half of the joints keep their target."""

    def __init__(self, robot: Declared, count: int, seconds: float, rng: np.random.Generator) -> None:
        self.ticks, joints = round(seconds * HZ), len(robot.joints)
        time = np.arange(self.ticks) / HZ
        reach = rng.uniform(0.1, 0.45, (count, 3, joints, 1))
        rate, phase = rng.uniform(0.15, 1.6, (count, 3, joints, 1)), rng.uniform(0, 2 * np.pi, (count, 3, joints, 1))
        rests = rng.random((count, 1, joints, int(seconds / 2.5) + 1)) < 0.5
        slot = np.minimum((time / 2.5).astype(int), rests.shape[-1] - 1)
        frozen = rests[..., slot] & (time % 2.5 > 1.5)
        clock = np.cumsum(np.where(frozen, 0.0, 1 / HZ), axis=-1)
        wave = (reach * np.sin(2 * np.pi * rate * clock + phase)).sum(axis=1)  # (R, J, T)
        self._targets = np.moveaxis(wave, -1, 0) + np.array([0.0, 0.5, 0.6, 0.0, 0.3])
        self.qpos = self._targets[0] + rng.normal(0, 0.02, (count, joints))
        self.qvel = np.zeros((count, joints))

    def target(self, tick: int, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """From the table; the arm does not look."""
        return self._targets[tick]


# Feedback of the balance on ankles and hips: target [rad] per rad, m, m/s and rad/s. Found by random search in
# simulation of the declared robot; they hold it up for 8 s under the motions below.
_PITCH, _ROLL, _HIP_PITCH, _HIP_ROLL = (7.02, 8.82, 4.8, 0.4), (-0.07, -4.23, -1.26, 0.6), (2.66, 0.02), (-0.86, -0.11)


class StandPlan:
    """Balance by ankles and hips from the true state of the base; arms, waist and legs move; it squats a little."""

    def __init__(self, robot: Declared, count: int, seconds: float, rng: np.random.Generator) -> None:
        self.ticks = round(seconds * HZ)
        model = robot.spec.compile()
        self.qpos = np.tile(model.key("stand").qpos, (count, 1))
        self.qvel = np.zeros((count, model.nv))
        self._home, self._names = self.qpos[0].copy(), list(robot.joints)
        time, joints = np.arange(self.ticks) / HZ, len(robot.joints)
        reach = rng.uniform(0.3, 1, (count, 3, joints, 1)) * np.array([_reach(n) for n in robot.joints])[:, None]
        rate, phase = rng.uniform(0.15, 1.2, (count, 3, joints, 1)), rng.uniform(0, 2 * np.pi, (count, 3, joints, 1))
        ramp = np.clip(time / 1.5, 0, 1)
        moves = (reach * np.sin(2 * np.pi * rate * time + phase)).sum(axis=1) * ramp
        squat = rng.uniform(0, 0.12, (count, 1)) * np.sin(2 * np.pi * rng.uniform(0.2, 0.5, (count, 1)) * time) * ramp
        for side in ("left", "right"):
            for part, share in (("hip_pitch", -1), ("knee", 2), ("ankle_pitch", -1)):
                moves[:, self._column(side, part)] += share * squat
        self._targets = np.moveaxis(moves, -1, 0) + stand_pose()

    def target(self, tick: int, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """The motions and the feedback."""
        w, x, y, z = qpos[:, 3:7].T
        pitch, roll = 2 * (w * y - z * x), 2 * (w * x + y * z)
        ahead, aside = qpos[:, 0] - self._home[0], qpos[:, 1] - self._home[1]
        body = _base_velocity(qpos[:, 3:7], qvel[:, :3])
        ankle_pitch = _PITCH @ np.stack((pitch, ahead, body[:, 0], qvel[:, 4]))
        ankle_roll = _ROLL @ np.stack((roll, aside, body[:, 1], qvel[:, 3]))
        hip_pitch, hip_roll = _HIP_PITCH @ np.stack((pitch, qvel[:, 4])), _HIP_ROLL @ np.stack((roll, qvel[:, 3]))
        out = self._targets[tick].copy()
        parts = (("ankle_pitch", ankle_pitch), ("ankle_roll", ankle_roll))
        for side in ("left", "right"):
            for part, change in (*parts, ("hip_pitch", hip_pitch), ("hip_roll", hip_roll)):
                out[:, self._column(side, part)] += change
        return out

    def _column(self, side: str, part: str) -> int:
        return self._names.index(f"{side}_{part}_joint")


def fallen(qpos: np.ndarray) -> np.ndarray:
    """Which robots (R,) are tilted by more than 0.5 rad, or low, or not numbers; qpos (R, nq) with a free base."""
    w, x, y, z = qpos[:, 3:7].T
    upright = (np.abs(2 * (w * y - z * x)) < 0.5) & (np.abs(2 * (w * x + y * z)) < 0.5) & (qpos[:, 2] > 0.5)
    return ~upright


def _reach(name: str) -> float:
    for words, reach in ((("shoulder", "elbow"), 0.3), (("waist_yaw",), 0.1), (("waist",), 0.025), (("ankle",), 0.008)):
        if any(word in name for word in words):
            return reach
    return 0.025


def _base_velocity(quat: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """World velocities (R, 3) in the frames of wxyz quaternions (R, 4)."""
    axis = -quat[:, 1:]
    cross = 2 * np.cross(axis, velocity)
    return velocity + quat[:, :1] * cross + np.cross(axis, cross)


def make_plan(
    robot: Declared, count: int, seconds: float, rng: np.random.Generator, policy: Path | None = None
) -> Plan:
    """The plan of a robot; `track` needs an exported policy."""
    if robot.name == "track":
        from benchmarks.undeclared.tracking import TrackPlan  # torch and the tracking task only where they are used

        assert policy is not None
        return TrackPlan(robot, count, seconds, rng, policy)
    return (StandPlan if robot.floating else ArmPlan)(robot, count, seconds, rng)
