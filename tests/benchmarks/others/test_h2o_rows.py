"""Rows of OmniH2O's and HOVER's rewards beside values computed by hand."""

import math

import pytest
import torch

from benchmarks.baselines.others import h2o_rows as rows
from benchmarks.baselines.others.hover import WEIGHTS as HOVER_WEIGHTS
from benchmarks.baselines.others.hover import scoring as hover_scoring
from benchmarks.baselines.others.omnih2o import ROWS, WEIGHTS, scoring
from tests.benchmarks.others.steps import J, judged, reference, state, turn_z


def test_kernels_are_one_where_nothing_is_off():
    for name in ("joint_position", "joint_velocity", "three_points", "body_rotation", "body_velocity"):
        assert ROWS[name](judged()).item() == pytest.approx(1.0)
    assert ROWS["body_position"](judged()).item() == pytest.approx(1.5)


def test_joint_position_is_the_kernel_of_the_mean_square():
    off = torch.zeros(1, J)
    off[0, :2] = torch.tensor([1.0, 2.0])
    value = rows.joint_position(0.5)(judged(ref=reference(joint_pos=off)))
    assert value.item() == pytest.approx(math.exp(-5.0 / 23 / 0.5))


def test_body_position_weighs_lower_and_upper_body_apart():
    keys = reference().key_pos_w.clone()
    keys[0, 2, 0] += 0.7  # a knee
    keys[0, 9, 1] += 0.3  # an elbow
    value = ROWS["body_position"](judged(ref=reference(key_pos_w=keys)))
    low, high = 0.49 / 21, 0.09 / 24  # 7 bodies; 7 and the head
    assert value.item() == pytest.approx(0.5 * math.exp(-low / 0.5) + math.exp(-high / 0.03))


def test_three_points_see_hands_and_head_alone():
    keys = reference().key_pos_w.clone()
    keys[0, 2, 0] += 1.0  # a knee does not count
    keys[0, 10, 2] += 0.3  # the left hand does
    value = rows.three_points(0.03)(judged(ref=reference(key_pos_w=keys)))
    assert value.item() == pytest.approx(math.exp(-0.09 / 9 / 0.03))


def test_body_rotation_and_angular_velocity():
    turned = reference(root_quat_w=turn_z(0.4)[None])
    assert rows.body_rotation(0.1)(judged(ref=turned)).item() == pytest.approx(math.exp(-1.6), rel=1e-4)
    # A turn of 2 rad/s about the vertical is the same in every heading.
    spun = reference(root_quat_w=turn_z(0.4)[None], root_ang_vel_b=torch.tensor([[0.0, 0.0, 2.0]]))
    assert rows.body_angular_velocity(10.0)(judged(ref=spun)).item() == pytest.approx(math.exp(-4 / 3 / 10))


def test_body_velocity_is_of_all_key_bodies():
    speed = torch.zeros(1, 14, 3)
    speed[0, 0, 0] = 2.0
    value = rows.body_velocity(10.0)(judged(feet={"key_vel_w": speed}))
    assert value.item() == pytest.approx(math.exp(-4 / 42 / 10))


def test_limits_count_what_is_beyond():
    torque = torch.zeros(1, J)
    torque[0, :2] = torch.tensor([12.0, -13.0])
    assert rows.torque_limits(judged(torque=torque)).item() == pytest.approx(5.0)
    assert rows.torques(judged(torque=torque)).item() == pytest.approx(144 + 169)
    pos = torch.zeros(1, J)
    pos[0, :2] = torch.tensor([1.2, -1.5])
    assert rows.joint_position_limits(judged(state(joint_pos=pos))).item() == pytest.approx(0.7)
    speed = torch.zeros(1, J)
    speed[0, :2] = torch.tensor([5.5, -9.0])
    assert rows.joint_velocity_limits(judged(state(joint_vel=speed))).item() == pytest.approx(0.5 + 1.0)


def test_action_rates_split_legs_from_the_rest():
    now, before = torch.zeros(1, J), torch.zeros(1, J)
    now[0, 11], now[0, 12] = 2.0, 3.0
    both = judged(actions=(now, before, before))
    assert rows.lower_action_rate(both).item() == 4.0 and rows.upper_action_rate(both).item() == 9.0


def test_feet():
    force = torch.tensor([[[0.0, 0.0, 700.0], [60.0, 0.0, 10.0]]])
    assert rows.feet_contact_forces(500.0)(judged(foot_force_w=force)).item() == pytest.approx(200.0)
    assert rows.stumble(judged(foot_force_w=force)).item() == 1.0
    assert rows.stumble(judged()).item() == 0.0
    speed = torch.zeros(1, 14, 3)
    speed[0, 3] = torch.tensor([0.3, 0.4, 0.0])
    assert rows.slippage(judged(feet={"key_vel_w": speed})).item() == pytest.approx(0.5)
    lifted = torch.tensor([[[0.0, 0.0, 0.5], [0.0, 0.0, 150.0]]])
    assert rows.slippage(judged(feet={"key_vel_w": speed}, foot_force_w=lifted)).item() == 0.0
    none = torch.zeros(1, 2, dtype=torch.bool)
    assert rows.in_the_air(judged(feet={"contact": none})).item() == 1.0
    assert rows.in_the_air(judged()).item() == 0.0


def test_landing_pays_for_long_flights_of_a_reference_that_moves_and_costs_low_ones():
    landing = {
        "landed": torch.tensor([[True, False]]),
        "air_time": torch.tensor([[0.4, 0.9]]),
        "height": torch.tensor([[0.15, 0.0]]),
    }
    moving = reference(root_lin_vel_w=torch.tensor([[0.3, 0.0, 0.0]]))
    assert rows.feet_air_time(judged(ref=moving, feet=landing)).item() == pytest.approx(0.15)
    assert rows.feet_air_time(judged(feet=landing)).item() == 0.0
    assert rows.feet_height(judged(feet=landing)).item() == pytest.approx(0.10)


def test_orientation_is_the_square_of_the_sine_of_the_lean():
    half = 0.15
    leaning = torch.tensor([[math.cos(half), math.sin(half), 0.0, 0.0]])
    assert rows.orientation(judged(state(root_quat_w=leaning))).item() == pytest.approx(math.sin(0.3) ** 2, rel=1e-5)
    quat = torch.stack((leaning[0], torch.tensor([1.0, 0.0, 0.0, 0.0])))[None]
    assert rows.feet_orientation(judged(foot_quat_w=quat)).item() == pytest.approx(math.sin(0.3), rel=1e-5)


def test_termination_is_what_is_lost():
    assert rows.termination(judged(lost=True)).item() == 1.0 and rows.termination(judged()).item() == 0.0


def test_weights_are_those_of_the_public_code():
    assert WEIGHTS["three_points"] == 50 and WEIGHTS["stumble"] == -1250 and WEIGHTS["feet_orientation"] == -62.5
    assert "joint_velocity_limits" not in scoring().curriculum.rows and "slippage" in scoring().curriculum.rows
    assert "body_rotation" not in HOVER_WEIGHTS and HOVER_WEIGHTS["stumble"] == -1000
    slow = torch.zeros(1, J)
    slow[0, 0] = 2.0
    step = judged(ref=reference(joint_vel=slow))
    assert hover_scoring().rows["joint_velocity"](step).item() == pytest.approx(math.exp(-4 / 23))
    assert ROWS["joint_velocity"](step).item() == pytest.approx(math.exp(-4 / 230))
