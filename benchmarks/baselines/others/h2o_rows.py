"""Rows of reward that OmniH2O and HOVER share, after the public code of both; weights stand with each policy.

Errors enter as exp(-mean square / sigma). Key bodies 0 to 6 are the lower body, 7 to 13 the upper one; legs are joints
0 to 11. What the simulator's limits are to a joint comes with the step, softened by the environment's `soft_limit`.
"""

from collections.abc import Callable

import torch
from torch import Tensor

from benchmarks.baselines.others.library import key_vel_w
from benchmarks.baselines.others.memory import FOOT_KEYS
from benchmarks.baselines.others.scoring import Judged, Row
from bumblebee.peers.geometry import head_pos_w
from bumblebee.robot.facts import BODY_OF, KEY_BODIES
from bumblebee.sim.rotations import angle_between, rotate, rotate_inverse

LOWER = 7
"""Key bodies before this one are of the lower body."""
LEGS = 12
"""Joints before this one are of the legs."""
HANDS = (KEY_BODIES.index(BODY_OF["left_hand"]), KEY_BODIES.index(BODY_OF["right_hand"]))
FOOT_HEIGHT = 0.25  # m
AIR_TIME = 0.25  # s
MOVING = 0.1  # m/s


def joint_position(sigma: float) -> Row:
    """Joint angles [rad]."""
    return _kernel(lambda j: (j.ref.joint_pos - j.state.joint_pos).square().mean(-1), sigma)


def joint_velocity(sigma: float) -> Row:
    """Joint speeds [rad/s]."""
    return _kernel(lambda j: (j.ref.joint_vel - j.state.joint_vel).square().mean(-1), sigma)


def body_velocity(sigma: float) -> Row:
    """Velocities of the key bodies [m/s]."""
    return _kernel(lambda j: (key_vel_w(j.ref) - j.now.key_vel_w).square().mean((-1, -2)), sigma)


def body_angular_velocity(sigma: float) -> Row:
    """Angular velocity of the root in the world [rad/s]; theirs is of all bodies."""

    def error(j: Judged) -> Tensor:
        turn_w = rotate(j.ref.root_quat_w, j.ref.root_ang_vel_b) - rotate(j.state.root_quat_w, j.state.root_ang_vel_b)
        return turn_w.square().mean(-1)

    return _kernel(error, sigma)


def body_rotation(sigma: float) -> Row:
    """Angle between the roots [rad]; theirs is of all bodies."""
    return _kernel(lambda j: angle_between(j.state.root_quat_w, j.ref.root_quat_w).square(), sigma)


def body_position(sigma_lower: float, sigma_upper: float, weight_lower: float, weight_upper: float) -> Row:
    """Places of all key bodies and the head [m], the lower body by a wide kernel and the upper one by a narrow one."""

    def row(j: Judged) -> Tensor:
        squares = (j.ref.key_pos_w - j.state.key_pos_w).square()
        upper = torch.cat((squares[:, LOWER:], _head_error(j).square()[:, None]), dim=1)
        low, high = squares[:, :LOWER].mean((-1, -2)), upper.mean((-1, -2))
        return weight_lower * torch.exp(-low / sigma_lower) + weight_upper * torch.exp(-high / sigma_upper)

    return row


def three_points(sigma: float) -> Row:
    """Places of both hands and the head [m]."""

    def error(j: Judged) -> Tensor:
        away = j.ref.key_pos_w - j.state.key_pos_w
        points = torch.stack((*(away[:, hand] for hand in HANDS), _head_error(j)), dim=1)
        return points.square().mean((-1, -2))

    return _kernel(error, sigma)


def torques(j: Judged) -> Tensor:
    """Squares of the torques [(N m)^2]."""
    return j.step.torque.square().sum(-1)


def torque_limits(j: Judged) -> Tensor:
    """Torques beyond the soft limit [N m]."""
    return (j.step.torque.abs() - j.step.limits.torque).clamp(min=0.0).sum(-1)


def joint_accelerations(j: Judged) -> Tensor:
    """Squares of the joints' accelerations [rad^2/s^4]."""
    return j.step.joint_acc.square().sum(-1)


def joint_velocities(j: Judged) -> Tensor:
    """Squares of the joints' speeds [rad^2/s^2]."""
    return j.state.joint_vel.square().sum(-1)


def lower_action_rate(j: Judged) -> Tensor:
    """Squared change of the legs' actions."""
    return (j.step.actions[0] - j.step.actions[1])[:, :LEGS].square().sum(-1)


def upper_action_rate(j: Judged) -> Tensor:
    """Squared change of the actions of waist and arms."""
    return (j.step.actions[0] - j.step.actions[1])[:, LEGS:].square().sum(-1)


def joint_position_limits(j: Judged) -> Tensor:
    """Angles beyond the soft limits [rad]."""
    pos, limits = j.state.joint_pos, j.step.limits
    return ((limits.low - pos).clamp(min=0.0) + (pos - limits.high).clamp(min=0.0)).sum(-1)


def joint_velocity_limits(j: Judged) -> Tensor:
    """Speeds beyond the soft limit, at most 1 rad/s a joint."""
    return (j.state.joint_vel.abs() - j.step.limits.speed).clamp(0.0, 1.0).sum(-1)


def termination(j: Judged) -> Tensor:
    """1 in the step that loses the episode."""
    return j.lost.float()


def feet_contact_forces(limit: float) -> Row:
    """Forces on the feet beyond a limit [N]."""
    return lambda j: (j.step.foot_force_w.norm(dim=-1) - limit).clamp(min=0.0).sum(-1)


def stumble(j: Judged) -> Tensor:
    """1 where a foot is pushed sideways more than five times as hard as up."""
    force = j.step.foot_force_w
    return (force[..., :2].norm(dim=-1) > 5 * force[..., 2].abs()).any(-1).float()


def slippage(j: Judged) -> Tensor:
    """Speed of the feet that the floor touches [m/s]."""
    speed = torch.stack([j.now.key_vel_w[:, i].norm(dim=-1) for i in FOOT_KEYS], dim=-1)
    return (speed * (j.step.foot_force_w.norm(dim=-1) > 1.0)).sum(-1)


def feet_orientation(j: Judged) -> Tensor:
    """How far the soles are from level: sum of |gravity_xy| in the feet's frames."""
    down = torch.zeros_like(j.step.foot_force_w)
    down[..., 2] = -1.0
    return rotate_inverse(j.step.foot_quat_w, down)[..., :2].norm(dim=-1).sum(-1)


def feet_air_time(j: Judged) -> Tensor:
    """Flight times beyond 0.25 s of the feet that land, where the reference's root moves [s]."""
    moving = j.ref.root_lin_vel_w[:, :2].norm(dim=-1) > MOVING
    return ((j.now.air_time - AIR_TIME) * j.now.landed).sum(-1) * moving


def feet_height(j: Judged) -> Tensor:
    """How much lower than 0.25 m the feet that land have stayed in their flight [m]."""
    return ((FOOT_HEIGHT - j.now.height).clamp(min=0.0) * j.now.landed).sum(-1)


def in_the_air(j: Judged) -> Tensor:
    """1 where no foot touches the floor."""
    return (~j.now.contact).all(-1).float()


def orientation(j: Judged) -> Tensor:
    """Squares of gravity's horizontal part in the base frame."""
    down = torch.zeros_like(j.state.root_pos_w)
    down[:, 2] = -1.0
    return rotate_inverse(j.state.root_quat_w, down)[:, :2].square().sum(-1)


def _kernel(error: Callable[[Judged], Tensor], sigma: float) -> Row:
    return lambda j: torch.exp(-error(j) / sigma)


def _head_error(j: Judged) -> Tensor:
    """From the robot's head to the reference's (B, 3) [m]."""
    of_ref = head_pos_w(j.ref.root_pos_w, j.ref.root_quat_w, j.ref.joint_pos)
    return of_ref - head_pos_w(j.state.root_pos_w, j.state.root_quat_w, j.state.joint_pos)
