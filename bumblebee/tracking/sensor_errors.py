"""Errors of a robot's own sensors that stay through an episode: encoders' zeros, an IMU's mounting, a gyro's bias.

They change what networks see, and nothing else: the simulator's servos, rewards and ends of episodes know the truth.
"""

from dataclasses import replace

import mujoco
import torch
from torch import Tensor

from bumblebee.robot.facts import KEY_BODIES
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import conjugate, from_rotation_vector, multiply, rotate
from bumblebee.tracking.config import SensorConfig
from bumblebee.tracking.forward_kinematics import ForwardKinematics
from bumblebee.tracking.rows import Rows


class SensorErrors:
    """Errors of B robots, in one tensor that stays where it is.

    Args:
        config: their largest values.
        model: the robot, for the key bodies that follow from the encoders.
        worlds: B.
        device: where the robots' states are.
    """

    def __init__(self, config: SensorConfig, model: mujoco.MjModel, worlds: int, device: torch.device) -> None:
        joints = model.njnt - 1
        most = [config.encoder_offset] * joints + [config.imu_offset] * 3 + [config.gyro_bias] * 3
        self.most = torch.tensor(most, dtype=torch.float32, device=device)
        """(J + 6,) largest value of each error."""
        self.now = torch.zeros(worlds, joints + 6, device=device)
        """(B, J + 6): joints' offsets [rad], rotation vector from base to IMU [rad], bias of the gyro [rad/s]."""
        self._kinematics = ForwardKinematics(model, list(KEY_BODIES), device)

    def draw(self, robots: int, generator: torch.Generator | None = None) -> Tensor:
        """Errors (robots, J + 6), uniform to both sides."""
        drawn = torch.empty(robots, len(self.most), device=self.most.device)
        return self.most * drawn.uniform_(-1, 1, generator=generator)

    def renew(self, rows: Rows, generator: torch.Generator) -> None:
        """Draw the errors of robots that begin an episode."""
        rows.put(self.now, self.draw(len(rows), generator))

    def read(self, state: RobotState, errors: Tensor) -> RobotState:
        """The state as sensors with `errors` (B, J + 6) tell it, key bodies by forward kinematics; has gradients."""
        offset, tilt, bias = errors.split((errors.shape[-1] - 6, 3, 3), dim=-1)
        turn = from_rotation_vector(tilt)
        quat, joint_pos = multiply(state.root_quat_w, turn), state.joint_pos + offset
        keys, _ = self._kinematics(state.root_pos_w, quat, joint_pos)
        gyro = rotate(conjugate(turn), state.root_ang_vel_b) + bias
        return replace(
            state, root_quat_w=quat, root_ang_vel_b=gyro, joint_pos=joint_pos, key_pos_w=keys, read_key_pos_w=None
        )
