"""Command to the drives for one control period: the low-level command of a robot with PD drives."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ServoCommand:
    """Torque of a drive = kp (target - reading) - kd velocity + torque, limited by the drive; n robots, J joints."""

    target: np.ndarray
    """(n, J) joint targets [rad]."""
    torque: np.ndarray | None = None
    """(n, J) feed-forward torque [N m]; None for none."""
    kp: np.ndarray | None = None
    """(J,), or (n, J) where robots differ, [N m/rad]; None for the robot's own gains."""
    kd: np.ndarray | None = None
    """(J,) or (n, J) [N m s/rad]; None for the robot's own gains."""

    def __getitem__(self, rows: np.ndarray) -> "ServoCommand":
        """The command to some of the robots, by index or mask (n,)."""
        kp, kd = (gain if gain is None or gain.ndim == 1 else gain[rows] for gain in (self.kp, self.kd))
        return ServoCommand(self.target[rows], None if self.torque is None else self.torque[rows], kp, kd)
