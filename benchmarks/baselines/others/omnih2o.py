"""OmniH2O: a privileged teacher that follows whole bodies, a student that follows hands and head (He et al., 2024).

Weights, kernels and settings of the public code, LeCAR-Lab/human2humanoid (`rewards_teleop_omnih2o_teacher.yaml`,
`ppo_teleop.yaml`, `domain_rand_teleop.yaml`); docs/baselines.md has the table and what was adapted.
"""

from benchmarks.baselines.others import h2o_rows as rows
from benchmarks.baselines.others.scoring import Curriculum, Row, Scoring
from benchmarks.baselines.others.spec import Baseline, StudentConfig, tilted
from bumblebee.learning.config import PpoConfig
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.presets import PAPER_RANDOMISATION
from bumblebee.tracking.rewards import RewardConfig

NAME = "omnih2o"
TEACHER = (
    "h2o_points_h",
    "h2o_rotation_h",
    "h2o_lin_vel_h",
    "h2o_ang_vel_h",
    "joint_pos",
    "joint_vel",
    "h2o_point_errors_h",
    "h2o_rotation_error_h",
    "h2o_lin_vel_error_h",
    "h2o_ang_vel_error_h",
    "h2o_joint_errors",
    "h2o_joint_vel_errors",
    "h2o_target_points_h",
    "h2o_target_rotation_h",
    "last_action",
)
"""The privileged teacher's terms."""
PROPRIOCEPTION = ("joint_pos", "joint_vel", "root_ang_vel_b", "gravity_b", "last_action")
"""Observation terms of the student's own body, now and over 25 control steps."""
GOAL = ("h2o_three_errors_h", "h2o_three_targets_h", "h2o_three_speeds_h")
"""Observation terms of the reference for the student: hands and head, now."""

ROWS: dict[str, Row] = {
    "joint_position": rows.joint_position(0.5),
    "joint_velocity": rows.joint_velocity(10.0),
    "body_position": rows.body_position(0.5, 0.03, 0.5, 1.0),
    "three_points": rows.three_points(0.03),
    "body_rotation": rows.body_rotation(0.1),
    "body_velocity": rows.body_velocity(10.0),
    "body_angular_velocity": rows.body_angular_velocity(10.0),
    "torques": rows.torques,
    "torque_limits": rows.torque_limits,
    "joint_accelerations": rows.joint_accelerations,
    "joint_velocities": rows.joint_velocities,
    "lower_action_rate": rows.lower_action_rate,
    "upper_action_rate": rows.upper_action_rate,
    "joint_position_limits": rows.joint_position_limits,
    "joint_velocity_limits": rows.joint_velocity_limits,
    "termination": rows.termination,
    "feet_contact_forces": rows.feet_contact_forces(500.0),
    "stumble": rows.stumble,
    "feet_air_time": rows.feet_air_time,
    "slippage": rows.slippage,
    "feet_orientation": rows.feet_orientation,
    "in_the_air": rows.in_the_air,
    "orientation": rows.orientation,
    "feet_height": rows.feet_height,
}
WEIGHTS = {
    "joint_position": 32.0,
    "joint_velocity": 16.0,
    "body_position": 30.0,
    "three_points": 50.0,
    "body_rotation": 20.0,
    "body_velocity": 8.0,
    "body_angular_velocity": 8.0,
    "torques": -1e-4,
    "torque_limits": -2.0,
    "joint_accelerations": -1.1e-5,
    "joint_velocities": -0.004,
    "lower_action_rate": -3.0,
    "upper_action_rate": -0.625,
    "joint_position_limits": -125.0,
    "joint_velocity_limits": -50.0,
    "termination": -250.0,
    "feet_contact_forces": -0.75,
    "stumble": -1250.0,
    "feet_air_time": 1000.0,
    "slippage": -37.5,
    "feet_orientation": -62.5,
    "in_the_air": -200.0,
    "orientation": -200.0,
    "feet_height": -2500.0,
}
UNSCALED = {"joint_velocity_limits", "feet_height"}
"""Punishing rows that the curriculum of the public code does not name."""
POSITIVE = {"joint_position", "joint_velocity", "body_position", "three_points", "body_rotation"} | {
    "body_velocity",
    "body_angular_velocity",
}
PPO = PpoConfig(
    steps=24,
    epochs=5,
    gamma=0.99,
    entropy=0.005,
    grad_norm=0.2,
    learning_rate=1e-3,
    learning_rate_range=(1e-4, 1e-2),
    desired_kl=0.01,
    desired_kl_end=0.01,
    hidden=(512, 256, 128),
    initial_std=1.0,
)


def scoring() -> Scoring:
    """The reward, its punishments growing from half to whole while episodes last."""
    scaled = tuple(name for name in WEIGHTS if name not in POSITIVE | UNSCALED)
    return Scoring(ROWS, WEIGHTS, Curriculum(start=0.5, least=0.25, degree=1e-4, rows=scaled))


def omnih2o() -> Baseline:
    """The policy with all its settings."""
    env = EnvConfig(
        action="default",
        observation=ObservationConfig(terms=TEACHER),
        student=ObservationConfig(terms=PROPRIOCEPTION, history=25, now=GOAL, noise=0.0),
        reward=RewardConfig(soft_limit=0.85),
        randomisation=PAPER_RANDOMISATION,
        threshold_start=1.5,
        threshold_end=1.5,
    )
    student = StudentConfig(steps=1, epochs=1, mini_batches=1, learning_rate=5e-4, grad_norm=0.2, loss="norm")
    return Baseline(NAME, env, PPO, student, scoring(), lost=tilted)
