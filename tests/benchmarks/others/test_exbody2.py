"""Rows of Exbody2's reward beside values computed by hand."""

import math

import pytest
import torch

from benchmarks.baselines.others import exbody2
from bumblebee.robot.facts import stand_pose
from tests.benchmarks.others.steps import J, judged, reference, state, turn_z


def test_velocity_is_compared_in_each_ones_own_frame():
    ref = reference(root_quat_w=turn_z(math.pi / 2)[None], root_lin_vel_w=torch.tensor([[0.0, 1.0, 0.0]]))
    ahead = state(root_lin_vel_b=torch.tensor([[1.0, 0.0, 0.0]]))
    assert exbody2.linear_velocity(judged(ahead, ref)).item() == pytest.approx(1.0, abs=1e-5)
    assert exbody2.linear_velocity(judged(state(), ref)).item() == pytest.approx(math.exp(-4.0), rel=1e-4)


def test_attitude():
    ref = reference(root_quat_w=turn_z(-3.0)[None])
    turned = state(root_quat_w=turn_z(3.0)[None])
    assert exbody2.yaw(judged(turned, ref)).item() == pytest.approx(math.exp(-(2 * math.pi - 6)), rel=1e-4)
    half = 0.1
    rolled = state(root_quat_w=torch.tensor([[math.cos(half), math.sin(half), 0.0, 0.0]]))
    assert exbody2.roll_pitch(judged(rolled)).item() == pytest.approx(math.exp(-0.2), rel=1e-4)


def test_joints_and_keys_are_norms_over_all_of_them():
    off = torch.zeros(1, J)
    off[0, :2] = torch.tensor([0.3, 0.4])
    assert exbody2.joint_position(judged(ref=reference(joint_pos=off))).item() == pytest.approx(math.exp(-0.35))
    keys = reference().key_pos_w.clone()
    keys[0, 1, 0] += 0.3
    keys[0, 2, 1] += 0.4
    assert exbody2.key_bodies(judged(ref=reference(key_pos_w=keys))).item() == pytest.approx(math.exp(-0.5))
    drifted = reference(root_pos_w=torch.tensor([[9.0, 0.0, 0.8]]), key_pos_w=keys + torch.tensor([9.0, 0.0, 0.0]))
    assert exbody2.key_bodies(judged(ref=drifted)).item() == pytest.approx(math.exp(-0.5), rel=1e-5)


def test_an_episode_is_lost_where_the_key_kernel_is_below_a_fifth():
    limit = -math.log(0.2)
    for distance, wanted in ((limit - 0.01, False), (limit + 0.01, True)):
        keys = reference().key_pos_w.clone()
        keys[0, 9, 0] += distance
        assert exbody2.lost(state(), reference(key_pos_w=keys)).item() is wanted


def test_regularisation():
    moving = state(root_lin_vel_b=torch.tensor([[0.0, 0.0, 0.5]]), root_ang_vel_b=torch.tensor([[1.0, 2.0, 9.0]]))
    assert exbody2.vertical_velocity(judged(moving)).item() == 0.25
    assert exbody2.tilt_velocity(judged(moving)).item() == 5.0
    a, b = torch.zeros(1, J), torch.zeros(1, J)
    a[0, 4], a[0, 0], b[0, 0] = 3.0, 4.0, 8.0
    assert exbody2.action_rate(judged(actions=(a, b, b))).item() == pytest.approx(5.0)
    assert exbody2.ankle_action(judged(actions=(a, b, b))).item() == 3.0
    torque, speed = torch.zeros(1, J), torch.zeros(1, J)
    torque[0, :2], speed[0, :2] = torch.tensor([3.0, -4.0]), torch.tensor([1.0, 1.0])
    assert exbody2.energy(judged(state(joint_vel=speed), torque=torque)).item() == pytest.approx(5.0)
    pose = torch.tensor(stand_pose(), dtype=torch.float32)[None].clone()
    pose[0, 0] += 0.5
    pose[0, 13], pose[0, 20] = 0.2, 1.0
    assert exbody2.leg_deviation(judged(state(joint_pos=pose))).item() == pytest.approx(0.25)
    assert exbody2.waist_deviation(judged(state(joint_pos=pose))).item() == pytest.approx(0.04)


def test_feet():
    speed = torch.zeros(1, 14, 3)
    speed[0, 3] = torch.tensor([0.3, 0.4, 7.0])
    assert exbody2.feet_drag(judged(feet={"key_vel_w": speed})).item() == pytest.approx(0.5)
    landing = {"landed": torch.tensor([[False, True]]), "air_time": torch.tensor([[9.0, 0.8]])}
    assert exbody2.feet_air_time(judged(feet=landing)).item() == pytest.approx(0.3)
    force = torch.tensor([[[0.0, 0.0, 600.0], [0.0, 0.0, 800.0]]])
    assert exbody2.feet_force(judged(foot_force_w=force)).item() == pytest.approx(500.0)
    assert exbody2.feet_force(judged()).item() == 0.0
