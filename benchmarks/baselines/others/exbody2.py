"""Exbody2: key bodies in the robot's own place, velocity for the rest, a student with a long history (Ji et al., 2024).

The authors' own code is not public. Tracking weights and kernels are those of the same group's public predecessor
(chengxuxin/expressive-humanoid, `h1_mimic_config.py`); observations, privileged terms, regularisation and the student's
settings those of a public reimplementation for a humanoid of 23 joints (AvidJoyceXu/exbody2-baseline).
docs/baselines.md has the table and what was adapted.
"""

import torch
from torch import Tensor

from benchmarks.baselines.others import h2o_rows
from benchmarks.baselines.others.memory import FOOT_KEYS
from benchmarks.baselines.others.scoring import Judged, Row, Scoring
from benchmarks.baselines.others.spec import Baseline, StudentConfig
from bumblebee.learning.config import PpoConfig
from bumblebee.peers.geometry import roll_pitch_yaw, wrapped
from bumblebee.robot.facts import joint_names, stand_pose
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import rotate_inverse
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.presets import PAPER_RANDOMISATION
from bumblebee.tracking.rewards import RewardConfig
from bumblebee.tracking.sampling.library import ReferenceFrame, over_robot
from bumblebee.tracking.terminations import fallen

NAME = "exbody2"
PROPRIOCEPTION = ("root_ang_vel_b", "ex_roll_pitch", "ex_yaw_error", "joint_pos", "ex_joint_vel", "last_action")
"""Observation terms of the robot that teacher and student see, now and over the history."""
GOAL = ("ex_target_joint_pos", "ex_target_lin_vel", "target_ang_vel", "ex_target_attitude", "ex_target_keys")
"""Observation terms of the reference that teacher and student see, now."""
PRIVILEGED = ("ex_key_errors", "key_pos_b", "root_lin_vel_b")
"""Observation terms that the teacher alone sees, now."""

AIR_TIME = 0.5  # s
FORCE = 500.0  # N
DRIFT = 10.0  # m: how far key bodies may be from the reference in the world, which is as good as any distance
LOST_KEYS = 0.2  # the key body kernel below which an episode is lost
_ANKLES = tuple(i for i, name in enumerate(joint_names()) if "ankle" in name)
_WAIST = tuple(i for i, name in enumerate(joint_names()) if name in ("waist_roll_joint", "waist_pitch_joint"))
_LEGS = 12


def linear_velocity(j: Judged) -> Tensor:
    """exp(-4 |v - v_ref|) [m/s], each in its own base frame."""
    wanted = rotate_inverse(j.ref.root_quat_w, j.ref.root_lin_vel_w)
    return torch.exp(-4.0 * (j.state.root_lin_vel_b - wanted).norm(dim=-1))


def yaw(j: Judged) -> Tensor:
    """exp(-|yaw error|) [rad]."""
    turn = roll_pitch_yaw(j.ref.root_quat_w)[2] - roll_pitch_yaw(j.state.root_quat_w)[2]
    return torch.exp(-wrapped(turn).abs())


def roll_pitch(j: Judged) -> Tensor:
    """exp(-|(roll, pitch) error|) [rad]."""
    own, wanted = roll_pitch_yaw(j.state.root_quat_w), roll_pitch_yaw(j.ref.root_quat_w)
    away = torch.stack((own[0] - wanted[0], own[1] - wanted[1]), dim=-1)
    return torch.exp(-away.norm(dim=-1))


def joint_position(j: Judged) -> Tensor:
    """exp(-0.7 |q - q_ref|) [rad]."""
    return torch.exp(-0.7 * (j.state.joint_pos - j.ref.joint_pos).norm(dim=-1))


def key_bodies(j: Judged) -> Tensor:
    """exp(-|p - p_ref|) [m] over all coordinates of all key bodies, the reference's root over the robot's."""
    return torch.exp(-_key_distance(j.state, j.ref))


def alive(j: Judged) -> Tensor:
    """1 in every step."""
    return torch.ones_like(j.step.torque[:, 0])


def vertical_velocity(j: Judged) -> Tensor:
    """Square of the base's velocity along its own z [m^2/s^2]."""
    return j.state.root_lin_vel_b[:, 2].square()


def tilt_velocity(j: Judged) -> Tensor:
    """Squares of the base's angular velocities about its x and y [rad^2/s^2]."""
    return j.state.root_ang_vel_b[:, :2].square().sum(-1)


def action_rate(j: Judged) -> Tensor:
    """|a - a_before|."""
    return (j.step.actions[0] - j.step.actions[1]).norm(dim=-1)


def energy(j: Judged) -> Tensor:
    """Norm of the joints' powers [W]."""
    return (j.step.torque * j.state.joint_vel).abs().norm(dim=-1)


def leg_deviation(j: Judged) -> Tensor:
    """Squares of the legs' distances from the stand [rad^2]."""
    return sum((j.state.joint_pos[:, i] - stand).square() for i, stand in enumerate(stand_pose()[:_LEGS]))


def feet_drag(j: Judged) -> Tensor:
    """Horizontal speed of the feet that touch the floor [m/s]."""
    speed = torch.stack([j.now.key_vel_w[:, i, :2].norm(dim=-1) for i in FOOT_KEYS], dim=-1)
    return (speed * j.now.contact).sum(-1)


def feet_air_time(j: Judged) -> Tensor:
    """Flight times beyond 0.5 s of the feet that land [s]."""
    return ((j.now.air_time - AIR_TIME) * j.now.landed).sum(-1)


def feet_force(j: Judged) -> Tensor:
    """Norm of both feet's vertical forces beyond 500 N, and 0 below it [N]."""
    return (j.step.foot_force_w[..., 2].norm(dim=-1) - FORCE).clamp(min=0.0)


def ankle_action(j: Judged) -> Tensor:
    """Norm of the ankles' actions."""
    return torch.stack([j.step.actions[0][:, i] for i in _ANKLES], dim=-1).norm(dim=-1)


def waist_deviation(j: Judged) -> Tensor:
    """Squares of waist roll and pitch [rad^2]."""
    return torch.stack([j.state.joint_pos[:, i] for i in _WAIST], dim=-1).square().sum(-1)


ROWS: dict[str, Row] = {
    "alive": alive,
    "linear_velocity": linear_velocity,
    "yaw": yaw,
    "roll_pitch": roll_pitch,
    "joint_position": joint_position,
    "key_bodies": key_bodies,
    "orientation": h2o_rows.orientation,
    "vertical_velocity": vertical_velocity,
    "tilt_velocity": tilt_velocity,
    "joint_accelerations": h2o_rows.joint_accelerations,
    "action_rate": action_rate,
    "energy": energy,
    "leg_deviation": leg_deviation,
    "stumble": h2o_rows.stumble,
    "feet_drag": feet_drag,
    "joint_position_limits": h2o_rows.joint_position_limits,
    "feet_air_time": feet_air_time,
    "feet_force": feet_force,
    "ankle_action": ankle_action,
    "waist_deviation": waist_deviation,
}
WEIGHTS = {
    "alive": 1.0,
    "linear_velocity": 6.0,
    "yaw": 1.0,
    "roll_pitch": 1.0,
    "joint_position": 3.0,
    "key_bodies": 2.0,
    "orientation": -2.0,
    "vertical_velocity": -1.0,
    "tilt_velocity": -0.4,
    "joint_accelerations": -3e-7,
    "action_rate": -0.1,
    "energy": -1e-3,
    "leg_deviation": -0.1,
    "stumble": -2.0,
    "feet_drag": -0.1,
    "joint_position_limits": -10.0,
    "feet_air_time": 10.0,
    "feet_force": -3e-3,
    "ankle_action": -0.1,
    "waist_deviation": -0.5,
}
PPO = PpoConfig(
    steps=24,
    epochs=5,
    gamma=0.99,
    entropy=0.005,
    grad_norm=1.0,
    learning_rate=2e-4,
    learning_rate_range=(1e-4, 1e-2),
    desired_kl=0.01,
    desired_kl_end=0.01,
    hidden=(512, 256, 128),
    initial_std=1.0,
)


def lost(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Robots (B,) bool that fell, or whose key body kernel is below 0.2."""
    return fallen(state, ref) | (torch.exp(-_key_distance(state, ref)) < LOST_KEYS)


def exbody2() -> Baseline:
    """The policy with all its settings."""
    env = EnvConfig(
        action="default",
        observation=ObservationConfig(terms=PROPRIOCEPTION, history=10, now=(*GOAL, *PRIVILEGED)),
        student=ObservationConfig(terms=PROPRIOCEPTION, history=25, now=GOAL),
        reward=RewardConfig(soft_limit=0.95),
        randomisation=PAPER_RANDOMISATION,
        threshold_start=DRIFT,
        threshold_end=DRIFT,
    )
    student = StudentConfig(
        steps=24, epochs=1, mini_batches=4, learning_rate=1e-4, grad_norm=1.0, hidden=(1024, 1024, 512), loss="mse"
    )
    return Baseline(NAME, env, PPO, student, Scoring(ROWS, WEIGHTS, lowest=-0.5), lost=lost)


def _key_distance(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Norm (B,) [m] over all coordinates of the key bodies' errors, the reference's root over the robot's."""
    return (over_robot(ref, state.root_pos_w).key_pos_w - state.key_pos_w).flatten(1).norm(dim=-1)
