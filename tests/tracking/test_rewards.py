"""Each row of the reward table against values worked out by hand."""

from dataclasses import replace

import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.robot.facts import joints
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import from_rotation_vector
from bumblebee.tracking import rewards
from bumblebee.tracking.rewards import Limits, Reward, RewardConfig, Step
from bumblebee.tracking.sampling.library import ReferenceFrame

Z3, Z23, UPRIGHT = torch.zeros(1, 3), torch.zeros(1, 23), torch.tensor([[1.0, 0, 0, 0]])


def perfect() -> Step:
    """One robot exactly on its reference, at rest, both feet level and loaded."""
    keys = torch.zeros(1, 14, 3)
    empty = torch.zeros(1, 0, 3)
    ref = ReferenceFrame(Z3, UPRIGHT, Z3, Z3, Z23, Z23, keys, Z23, empty, torch.zeros(1, 0, 4), torch.zeros(1, 0, 23))
    force = torch.tensor([[[0.0, 0, 150], [0, 0, 150]]])
    return Step(
        state=RobotState(Z3, UPRIGHT, Z3, Z3, Z23, Z23, keys),
        ref=ref,
        torque=Z23,
        joint_acc=Z23,
        actions=(Z23, Z23, Z23),
        foot_force_w=force,
        foot_quat_w=UPRIGHT[:, None].expand(1, 2, 4),
        limits=Limits.of_robot(),
    )


def one(index: int, value: float) -> torch.Tensor:
    out = Z23.clone()
    out[0, index] = value
    return out


def moved(**changes: torch.Tensor) -> Step:
    step = perfect()
    return replace(step, state=replace(step.state, **changes))


def test_perfect_tracking_earns_the_sum_of_the_task_weights() -> None:
    """All errors and penalties vanish: 3.5 with the paper's weights, times the control period."""
    assert Reward(RewardConfig(preset="paper"), 0.02)(perfect()).item() == pytest.approx(3.5 * 0.02)


def test_limits() -> None:
    """Torque, position and velocity beyond the left hip pitch's 88 N m, 2.8798 rad, 32 rad/s; inside, nothing."""
    step = perfect()
    assert rewards.torque_limits(replace(step, torque=one(0, -89.0))) == 1
    assert rewards.torque_limits(replace(step, torque=one(0, 87.0))) == 0
    assert rewards.dof_position_limits(moved(joint_pos=one(0, 2.9))) == 1
    assert rewards.dof_position_limits(moved(joint_pos=one(0, 2.8))) == 0
    assert rewards.dof_velocity_limits(moved(joint_vel=one(0, -33.0))) == 1
    assert rewards.dof_velocity_limits(moved(joint_vel=one(0, 31.0))) == 0


def test_soft_limits_shrink_the_range_about_its_middle() -> None:
    """At 0.9 the left knee's range loses a twentieth at each end."""
    soft, hard, knee = Limits.of_robot(0.9), Limits.of_robot(), [j.name for j in joints()].index("left_knee_joint")
    width = hard.high[knee] - hard.low[knee]
    assert (hard.high - soft.high)[knee].item() == pytest.approx(0.05 * width.item(), rel=1e-4)
    assert (soft.low - hard.low)[knee].item() == pytest.approx(0.05 * width.item(), rel=1e-4)
    assert soft.torque[knee].item() == pytest.approx(0.9 * 139)


def test_regularisation() -> None:
    """Accelerations 3 and 4 give 25; actions 5, 2, 1 give a rate of 9 and a second difference of 2; torque 5."""
    step = perfect()
    acc = one(0, 3.0) + one(5, 4.0)
    assert rewards.dof_acceleration(replace(step, joint_acc=acc)).item() == pytest.approx(25)
    acting = replace(step, actions=(one(2, 5.0), one(2, 2.0), one(2, 1.0)))
    assert rewards.action_rate(acting).item() == pytest.approx(9)
    assert rewards.action_smoothness(acting).item() == pytest.approx(4)  # 5 - 2 * 2 + 1 = 2
    assert rewards.torque(replace(step, torque=one(0, 3.0) + one(1, -4.0))).item() == pytest.approx(5)


def test_stumble() -> None:
    """A foot pushed sideways by more than five times its load stumbles; one that is loaded does not."""
    force = torch.tensor([[[60.0, 0, 10], [0, 0, 150]]])
    assert rewards.stumble(replace(perfect(), foot_force_w=force)) == 1
    assert rewards.stumble(replace(perfect(), foot_force_w=force * torch.tensor([0.8, 1, 1]))) == 0
    assert rewards.stumble(perfect()) == 0


def test_feet_orientation() -> None:
    """A foot rolled by 0.3 rad sees sin 0.3 of gravity in its plane; yaw does not count."""
    tilted = torch.stack((from_rotation_vector(torch.tensor([[0.3, 0, 0]])), UPRIGHT), dim=1)
    assert rewards.feet_orientation(replace(perfect(), foot_quat_w=tilted)).item() == pytest.approx(0.29552, abs=1e-5)
    yawed = from_rotation_vector(torch.tensor([[[0.0, 0, 1.0], [0, 0, -2.0]]]))
    assert rewards.feet_orientation(replace(perfect(), foot_quat_w=yawed)).item() == pytest.approx(0, abs=1e-6)


def test_errors_of_the_task_terms() -> None:
    """Each error by hand: one key body of 14 off by 0.5 m, 0.4 rad of yaw, 3-4-5 velocities and joints."""
    keys = torch.zeros(1, 14, 3)
    keys[0, 3] = torch.tensor([0.3, 0.0, 0.4])
    v345 = torch.tensor([[3.0, 0.0, 4.0]])
    assert rewards.body_position(moved(key_pos_w=keys)).item() == pytest.approx(0.5 / 14)
    yaw = from_rotation_vector(torch.tensor([[0.0, 0.0, 0.4]]))
    assert rewards.root_rotation(moved(root_quat_w=yaw)).item() == pytest.approx(0.4, abs=1e-5)
    assert rewards.root_rotation(moved(root_quat_w=-yaw)).item() == pytest.approx(0.4, abs=1e-5)
    assert rewards.root_angular_velocity(moved(root_ang_vel_b=v345)).item() == pytest.approx(5)
    assert rewards.root_velocity(moved(root_lin_vel_b=v345)).item() == pytest.approx(5)
    assert rewards.dof_position(moved(joint_pos=one(0, 0.3) + one(9, 0.4))).item() == pytest.approx(0.5)
    assert rewards.dof_velocity(moved(joint_vel=one(0, 3.0) + one(9, 4.0))).item() == pytest.approx(5)


def test_the_papers_kernel() -> None:
    """An error e enters as weight * exp(-4 e): 0.25 rad of yaw leave 0.5 / e of the root rotation's half."""
    yaw = from_rotation_vector(torch.tensor([[0.0, 0.0, 0.25]]))
    terms = Reward(RewardConfig(preset="paper"), 0.02).terms(moved(root_quat_w=yaw))
    assert terms["root_rotation"].item() == pytest.approx(0.5 / 2.718281828, rel=1e-4)


def test_the_papers_weights() -> None:
    """The table's fifteen weights, as printed."""
    printed = [-10, -10, -10, -3e-8, -2, -2, -1e-4, -0.00125, -2, 1, 0.5, 0.5, 0.5, 0.5, 0.5]
    assert list(rewards.PAPER_WEIGHTS.values()) == printed


def test_an_unknown_term_is_refused() -> None:
    """A misspelt weight, or a sharpness of a term that has none, is one line, not a silent nothing."""
    with pytest.raises(BadInput, match=r"action_rate.*came 'action_rat'$"):
        Reward(RewardConfig(weights={"action_rat": -1.0}), 0.02)
    with pytest.raises(BadInput, match=r"came 'torque'$"):
        Reward(RewardConfig(sharpness={"torque": 1.0}), 0.02)


def _punished() -> Step:
    """A robot on its reference whose action jumped by one unit on one joint."""
    return replace(perfect(), actions=(one(3, 1.0), Z23, Z23))


def test_punishing_terms_grow_with_the_training_and_the_others_do_not() -> None:
    config = RewardConfig(preset="paper", ramp_start=0.1, ramp_share=0.5)
    own = Reward(config, 1.0)
    earned = []
    for done in (0.0, 0.25, 0.5, 1.0):
        own.progress(done)
        earned.append(own(_punished()).item())
    assert earned == pytest.approx([3.5 - 4 * factor for factor in (0.1, 0.55, 1.0, 1.0)])


def test_a_step_earns_at_least_the_floor() -> None:
    config = RewardConfig(preset="paper", floor=0.0)
    assert Reward(config, 0.02)(_punished()).item() == 0.0
    assert Reward(config, 0.02)(perfect()).item() == pytest.approx(3.5 * 0.02)
    assert Reward(RewardConfig(preset="paper"), 0.02)(_punished()).item() == pytest.approx(-0.5 * 0.02)
