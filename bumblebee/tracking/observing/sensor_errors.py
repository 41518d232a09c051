"""Errors of a robot's own sensors that stay through an episode: encoders' zeros, an IMU's mounting, a gyro's bias.

The place by odometry drifts in it besides, by the law of the stand-in robot (`bumblebee.policy.odometry`): velocity,
summed up, with a scale that is off and a heading that wanders; the height does not drift.

They change what networks see, and nothing else: the simulator's servos, rewards and ends of episodes know the truth.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import Tensor

from bumblebee.robot.facts import KEY_BODIES, joint_names
from bumblebee.robot.model import build_model
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import conjugate, from_rotation_vector, multiply, rotate
from bumblebee.tracking.config import SensorConfig
from bumblebee.tracking.forward_kinematics import ForwardKinematics
from bumblebee.tracking.rows import Rows

_DRIFT = 4  # numbers of an odometry's error: scale, heading, and shift in the plane


class SensorErrors:
    """Errors of B robots, in one tensor that stays where it is.

    Args:
        config: their largest values.
        worlds: B.
        device: where the robots' states are.
    """

    def __init__(self, config: SensorConfig, worlds: int, device: torch.device) -> None:
        joints = len(joint_names())
        most = [config.encoder_offset] * joints + [config.imu_offset] * 3 + [config.gyro_bias] * 3
        self.most = torch.tensor(most, dtype=torch.float32, device=device)
        """(J + 6,) largest value of each error that stays."""
        self.drifts, self._config = config.drifts, config
        self._joints, self._drift = joints, _DRIFT if config.drifts else 0
        self.now = torch.zeros(worlds, joints + 6 + self._drift, device=device)
        """(B, J + 6): joints' offsets [rad], rotation vector from base to IMU [rad], bias of the gyro [rad/s]; where
        odometry drifts (B, J + 10): its error of scale, error of heading [rad] and shift in the plane [m] too."""
        self._kinematics = ForwardKinematics(build_model(), list(KEY_BODIES), device)

    def draw(self, robots: int, generator: torch.Generator | None = None) -> Tensor:
        """Errors (robots, E) at an episode's start, those that stay uniform to both sides."""
        drawn = torch.empty(robots, len(self.most), device=self.most.device)
        drawn = self.most * drawn.uniform_(-1, 1, generator=generator)
        if not self.drifts:
            return drawn
        scale = torch.empty(robots, 1, device=drawn.device).normal_(generator=generator)
        return torch.cat((drawn, self._config.odometry_scale * scale, torch.zeros_like(drawn[:, :3])), dim=-1)

    def under_way(self, robots: int) -> Tensor:
        """Errors (robots, E) of robots within their episodes: of the odometry, those of worlds now, drawn."""
        drawn = self.draw(robots)
        if self.drifts:
            world = torch.randint(len(self.now), (robots,), device=self.now.device)
            drawn[:, -_DRIFT:] = self.now[world, -_DRIFT:]
        return drawn

    def renew(self, rows: Rows, generator: torch.Generator) -> None:
        """Draw the errors of robots that begin an episode."""
        rows.put(self.now, self.draw(len(rows), generator))

    def after(
        self, errors: Tensor, way: Sequence[RobotState], dt: float, generator: torch.Generator | None = None
    ) -> Tensor:
        """Errors (B, E) a control step of `dt` [s] later, on the way from a state to the next; without gradients."""
        if not self.drifts:
            return errors
        stays, scale, heading, shift = errors.split((errors.shape[-1] - _DRIFT, 1, 1, 2), dim=-1)
        speeds = [rotate(state.root_quat_w, state.root_lin_vel_b)[:, :2].detach() for state in way]
        ahead, aside = (0.5 * dt * (speeds[0] + speeds[1])).split(1, dim=-1)
        cosine, sine = (1 + scale) * heading.cos(), (1 + scale) * heading.sin()
        believed = torch.cat((cosine * ahead - sine * aside, sine * ahead + cosine * aside), dim=-1)
        wander = torch.empty_like(heading).normal_(generator=generator)
        heading = heading + self._config.odometry_heading * math.sqrt(dt) * wander
        shift = shift + believed - torch.cat((ahead, aside), dim=-1)
        return torch.cat((stays, scale, heading, shift), dim=-1)

    def read(self, state: RobotState, errors: Tensor) -> RobotState:
        """The state as sensors with `errors` (B, E) tell it, key bodies by forward kinematics; has gradients."""
        offset, tilt, bias, drift = errors.split((self._joints, 3, 3, self._drift), dim=-1)
        turn = from_rotation_vector(tilt)
        quat, joint_pos = multiply(state.root_quat_w, turn), state.joint_pos + offset
        place = state.root_pos_w
        if self.drifts:
            place = place + torch.nn.functional.pad(drift[:, -2:], (0, 1))
        keys, _ = self._kinematics(place, quat, joint_pos)
        gyro = rotate(conjugate(turn), state.root_ang_vel_b) + bias
        return replace(
            state,
            root_pos_w=place,
            root_quat_w=quat,
            root_ang_vel_b=gyro,
            joint_pos=joint_pos,
            key_pos_w=keys,
            read_key_pos_w=None,
        )
