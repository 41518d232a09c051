"""Readings of the robot's sensors at one control tick, and the noise that is in them."""

from dataclasses import dataclass, fields

import numpy as np

from bumblebee import quaternions


@dataclass(frozen=True)
class Sensors:
    """Readings of B robots, float64; the measured-rollout contract's columns of the same names.

    `joint_pos` (B, J) [rad], `joint_vel` (B, J) [rad/s], `base_quat` (B, 4) wxyz, `base_ang_vel` (B, 3) [rad/s, base],
    `base_lin_vel` (B, 3) [m/s, base], `base_pos` (B, 3) [m, world], `joint_torque` (B, J) [N m] that the drive
    reports, `foot_force` (B, 2, 3) [N, world].
    """

    joint_pos: np.ndarray
    joint_vel: np.ndarray
    base_quat: np.ndarray
    base_ang_vel: np.ndarray
    base_lin_vel: np.ndarray
    base_pos: np.ndarray
    joint_torque: np.ndarray
    foot_force: np.ndarray

    def __getitem__(self, ids: np.ndarray) -> "Sensors":
        """The readings of some of the robots."""
        return Sensors(**{f.name: getattr(self, f.name)[ids] for f in fields(self)})


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations of white noise on each reading."""

    joint_pos: float = 5e-4
    """Encoders [rad]."""
    joint_vel: float = 0.02
    """Joint speeds [rad/s]."""
    base_ang_vel: float = 0.01
    """Gyro [rad/s]."""
    base_quat: float = 0.002
    """Orientation, a random small rotation about each axis [rad]."""
    base_lin_vel: float = 0.02
    """Odometry [m/s]."""
    base_pos: float = 0.001
    """Motion capture [m]."""
    base: str = "mocap"
    """How the base's place is known: `mocap`, or `odometry`, which drifts (`bumblebee.policy.odometry`)."""


NO_NOISE = SensorNoise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def draws(joints: int) -> int:
    """How many standard normal numbers one tick of one robot takes."""
    return 2 * joints + 12


def add_noise(true: Sensors, noise: SensorNoise, normal: np.ndarray) -> Sensors:
    """Noisy readings from true ones and standard normal draws (B, draws(J))."""
    joints = true.joint_pos.shape[1]
    pos, vel, gyro, turn, lin, place = np.split(normal, np.cumsum([joints, joints, 3, 3, 3]), axis=1)
    angle = noise.base_quat * turn
    small = quaternions.normalised(np.concatenate([np.ones((len(angle), 1)), angle / 2], axis=1))
    return Sensors(
        joint_pos=true.joint_pos + noise.joint_pos * pos,
        joint_vel=true.joint_vel + noise.joint_vel * vel,
        base_quat=quaternions.multiply(true.base_quat, small),
        base_ang_vel=true.base_ang_vel + noise.base_ang_vel * gyro,
        base_lin_vel=true.base_lin_vel + noise.base_lin_vel * lin,
        base_pos=true.base_pos + noise.base_pos * place,
        joint_torque=true.joint_torque,
        foot_force=true.foot_force,
    )
