"""Excitation of the robots: an arm follows sums of sines and rests, a humanoid stands, shifts weight, moves its arms.

A plan gives the target of every tick from the robot's true state, so that a standing robot can balance.
"""

from pathlib import Path
from typing import Protocol

import numpy as np

from benchmarks.undeclared.balance import balance_of
from bumblebee.robot.facts import ANKLE_JOINTS, SIDES, limb
from bumblebee.stand_in.undeclared.declared import Declared

HZ = 50.0
_LOW = 0.015  # m, by which a standing robot lowers its hips at most


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


class StandPlan:
    """Balance from the true state of the base; arms, trunk and legs move; it squats a little."""

    def __init__(self, robot: Declared, count: int, seconds: float, rng: np.random.Generator) -> None:
        self.ticks, joints = round(seconds * HZ), len(robot.joints)
        self._balance = balance_of(robot, HZ)
        self.qpos = np.tile(self._balance.home, (count, 1))
        self.qvel = np.zeros((count, self._balance.model.nv))
        time = np.arange(self.ticks) / HZ
        reach = rng.uniform(0.3, 1, (count, 3, joints, 1)) * _reach(robot)[:, None]
        rate, phase = rng.uniform(0.15, 1.2, (count, 3, joints, 1)), rng.uniform(0, 2 * np.pi, (count, 3, joints, 1))
        ramp = np.clip(time / 1.5, 0, 1)
        moves = (reach * np.sin(2 * np.pi * rate * time + phase)).sum(axis=1) * ramp  # (R, J, T)
        low = rng.uniform(0, _LOW, (count, 1)) * np.sin(2 * np.pi * rng.uniform(0.2, 0.5, (count, 1)) * time) * ramp
        self._low = low.T
        self._moves = np.moveaxis(moves, -1, 0) + self._low[:, :, None] * self._balance.lower

    def target(self, tick: int, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """The motions and the feedback."""
        return self._balance.targets(self._moves[tick], self._low[tick], qpos, qvel)


def fallen(qpos: np.ndarray) -> np.ndarray:
    """Which robots (R,) are tilted by more than 0.5 rad, or low, or not numbers; qpos (R, nq) with a free base."""
    w, x, y, z = qpos[:, 3:7].T
    upright = (np.abs(2 * (w * y - z * x)) < 0.5) & (np.abs(2 * (w * x + y * z)) < 0.5) & (qpos[:, 2] > 0.5)
    return ~upright


def _reach(robot: Declared) -> np.ndarray:
    """Amplitude (J,) [rad] of each of a joint's sines: arms move, the trunk turns, legs and trunk shift the weight."""
    arms = {name for side in SIDES for name in limb(side, "hand")}
    legs = {name for side in SIDES for name in limb(side, "foot")}

    def of(name: str) -> float:
        if name in arms:
            return 0.3
        if name in ANKLE_JOINTS:
            return 0.008
        return 0.1 if name not in legs and abs(robot.spec.joint(name).axis[2]) > 0.9 else 0.025

    return np.array([of(name) for name in robot.joints])


def make_plan(
    robot: Declared, count: int, seconds: float, rng: np.random.Generator, policy: Path | None = None
) -> Plan:
    """The plan of a robot; `track` needs an exported policy."""
    if robot.name == "track":
        from benchmarks.undeclared.tracking import TrackPlan  # torch and the tracking task only where they are used

        assert policy is not None
        return TrackPlan(robot, count, seconds, rng, policy)
    return (StandPlan if robot.floating else ArmPlan)(robot, count, seconds, rng)
