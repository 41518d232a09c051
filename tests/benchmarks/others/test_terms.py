"""Observations of the baselines beside values computed by hand."""

import math

import pytest
import torch

from benchmarks.baselines.others import env as _registered  # noqa: F401
from benchmarks.baselines.others import exbody2_terms, h2o_terms, hover_terms
from benchmarks.baselines.others.registry import BASELINES, baseline
from bumblebee.errors import BadInput
from bumblebee.motion.kinematics import forward_key_positions
from bumblebee.peers.geometry import head_pos_w, heading_inverse, roll_pitch_yaw, wrapped
from bumblebee.robot.facts import joint_names
from bumblebee.sim.rotations import from_rotation_vector, multiply, rotate
from bumblebee.tracking.observing.terms import Seen, expanded, parts, see
from tests.benchmarks.others.steps import J, K, reference, state, turn_z

LEFT = turn_z(math.pi / 2)[None]


def seen(now=None, ref=None) -> Seen:
    return Seen.of(now or state(), ref or reference(), torch.zeros(1, J))


def test_the_heading_is_taken_off_and_the_lean_stays():
    lean = from_rotation_vector(torch.tensor([[0.0, 0.3, 0.0]]))
    left = multiply(LEFT, lean)
    assert torch.allclose(multiply(heading_inverse(left), left), lean, atol=1e-6)


def test_roll_pitch_yaw():
    about = [from_rotation_vector(torch.eye(3)[i : i + 1] * angle) for i, angle in enumerate((0.1, 0.2, 0.3))]
    angles = roll_pitch_yaw(multiply(multiply(about[2], about[1]), about[0]))
    assert [round(float(a), 5) for a in angles] == [0.1, 0.2, 0.3]
    assert wrapped(torch.tensor(3.0) * math.pi).item() == pytest.approx(-math.pi)


def test_the_head_is_43_cm_above_the_torso_and_leans_with_the_waist():
    straight = head_pos_w(torch.zeros(1, 3), LEFT, torch.zeros(1, J))
    # the torso's origin is 4.4 cm above the pelvis and 4 mm behind it, here to the robot's left
    assert torch.allclose(straight, torch.tensor([[0.0, -0.0039635, 0.474]]), atol=1e-6)
    bent = torch.zeros(1, J)
    bent[0, joint_names().index("waist_pitch_joint")] = 0.5
    upright = torch.tensor([[1.0, 0.0, 0.0, 0.0]])
    moved = head_pos_w(torch.zeros(1, 3), upright, bent)
    assert torch.allclose(moved[0], torch.tensor([0.43 * math.sin(0.5) - 0.0039635, 0.0, 0.044 + 0.43 * math.cos(0.5)]))


def test_the_head_moves_with_the_torso_of_the_kinematics():
    draws = torch.Generator().manual_seed(0)
    joints = 0.4 * torch.randn(1, J, generator=draws)
    quat = from_rotation_vector(torch.randn(1, 3, generator=draws))
    keys = torch.as_tensor(forward_key_positions(*(v.numpy() for v in (torch.zeros(1, 3), quat, joints)))).float()
    head = head_pos_w(torch.zeros(1, 3), quat, joints)
    assert torch.isclose((head - keys[:, 7]).norm(), torch.tensor(0.43), atol=1e-5)


def test_h2o_points_and_errors_are_in_the_heading_frame():
    keys = reference().key_pos_w.clone()
    keys[0, 10] += torch.tensor([0.0, 1.0, 0.5])
    own = seen(state(root_quat_w=LEFT), reference(key_pos_w=keys))
    # the robot looks along y: what lies along y is ahead of it
    hand = h2o_terms.h2o_three_errors_h(own)[0, :3]
    assert torch.allclose(hand, torch.tensor([1.0, 0.0, 0.5]), atol=1e-6)
    assert torch.allclose(h2o_terms.h2o_three_targets_h(own)[0, :3], torch.tensor([1.0, 0.0, 0.5]), atol=1e-6)
    points = h2o_terms.h2o_point_errors_h(own).view(15, 3)
    assert torch.allclose(points[10], torch.tensor([1.0, 0.0, 0.5]), atol=1e-6)


def test_h2o_velocities_are_in_the_heading_frame():
    forward = state(root_quat_w=LEFT, root_lin_vel_b=torch.tensor([[1.0, 0.0, 0.0]]))
    own = seen(forward, reference(root_lin_vel_w=torch.tensor([[0.0, 3.0, 0.0]])))
    assert torch.allclose(h2o_terms.h2o_lin_vel_h(own), torch.tensor([[1.0, 0.0, 0.0]]), atol=1e-6)
    assert torch.allclose(h2o_terms.h2o_lin_vel_error_h(own), torch.tensor([[2.0, 0.0, 0.0]]), atol=1e-6)


def test_h2o_rotation_error_is_the_turn_from_robot_to_reference():
    own = seen(state(root_quat_w=turn_z(0.2)[None]), reference(root_quat_w=turn_z(0.5)[None]))
    six = h2o_terms.h2o_rotation_error_h(own)[0]
    assert torch.allclose(six[0::2], torch.tensor([math.cos(0.3), math.sin(0.3), 0.0]), atol=1e-6)


def test_a_place_and_heading_in_the_world_change_nothing_of_h2o():
    draws = torch.Generator().manual_seed(1)
    quat = from_rotation_vector(0.3 * torch.randn(1, 3, generator=draws))
    aim = from_rotation_vector(0.3 * torch.randn(1, 3, generator=draws))
    keys, wanted = (torch.randn(1, K, 3, generator=draws) for _ in range(2))
    root, goal = (torch.randn(1, 3, generator=draws) for _ in range(2))
    speed = torch.randn(1, K, 3, generator=draws)
    turn, shift = turn_z(1.1)[None], torch.tensor([[2.0, -3.0, 0.0]])

    def whole(q, s):
        def place(v):
            return rotate(q.expand(*v.shape[:-1], 4), v) + s

        def along(v):
            return rotate(q.expand(*v.shape[:-1], 4), v)

        now = state(root_pos_w=place(root), root_quat_w=multiply(q, quat), key_pos_w=place(keys))
        ref = reference(
            root_pos_w=place(goal),
            root_quat_w=multiply(q, aim),
            key_pos_w=place(wanted),
            key_vel_w=along(speed),
            root_lin_vel_w=along(goal),
        )
        names = expanded(tuple(t.__name__ for t in (*h2o_terms.SIZES, *hover_terms.SIZES)))
        return see(names, now, ref, torch.zeros(1, J))

    still = torch.tensor([[1.0, 0.0, 0.0, 0.0]])
    assert torch.allclose(whole(still, torch.zeros(1, 3)), whole(turn, shift), atol=1e-5)


def test_exbody2_forgives_drift_but_not_height():
    keys = reference().key_pos_w + torch.tensor([5.0, 0.0, 0.1])
    ref = reference(root_pos_w=torch.tensor([[5.0, 0.0, 0.9]]), key_pos_w=keys)
    errors = exbody2_terms.ex_key_errors(seen(ref=ref)).view(K, 3)
    assert torch.allclose(errors, torch.tensor([0.0, 0.0, 0.1]), atol=1e-6)


def test_exbody2_takes_velocities_and_keys_in_the_references_own_frame():
    keys = reference().key_pos_w.clone()
    keys[0, 5] += torch.tensor([0.0, 2.0, 0.0])
    ref = reference(root_quat_w=LEFT, root_lin_vel_w=torch.tensor([[0.0, 1.5, 0.0]]), key_pos_w=keys)
    own = seen(ref=ref)
    assert torch.allclose(exbody2_terms.ex_target_lin_vel(own), torch.tensor([[1.5, 0.0, 0.0]]), atol=1e-6)
    assert torch.allclose(exbody2_terms.ex_target_keys(own).view(K, 3)[5], torch.tensor([2.0, 0.0, 0.0]), atol=1e-6)
    assert torch.allclose(exbody2_terms.ex_yaw_error(own), torch.tensor([[-1.0, 0.0]]), atol=1e-6)


def test_exbody2_does_not_see_the_speed_of_ankles_and_of_waist_roll_and_pitch():
    hidden = exbody2_terms.ex_joint_vel(seen(state(joint_vel=torch.ones(1, J))))[0].tolist()
    assert [name for name, v in zip(joint_names(), hidden, strict=True) if v == 0] == [
        "left_ankle_pitch_joint",
        "left_ankle_roll_joint",
        "right_ankle_pitch_joint",
        "right_ankle_roll_joint",
        "waist_roll_joint",
        "waist_pitch_joint",
    ]


def test_hovers_modes_follow_what_the_public_code_follows():
    table = hover_terms.mode_table()
    count = dict(zip(hover_terms.MODES, table.sum(1).int().tolist(), strict=True))
    # 3 waist and 8 arm joints, 7 of the root; 23 joints, 7; 2 shoulders, elbows, hands, feet; hands, head; 15 + 23 + 7
    assert count == {"exbody": 18, "humanplus": 30, "h2o": 8, "omnih2o": 3, "all": 45}


def test_hovers_masked_command_is_nought_where_the_mask_is():
    ref = reference(joint_pos=torch.full((1, J), 0.3), key_pos_w=reference().key_pos_w + 0.2)
    own = seen(ref=ref)
    whole = hover_terms.whole_command(own)
    mask = hover_terms.mode_table(("omnih2o",))
    masked = whole * hover_terms.spread(mask)
    points = masked[0, :45].view(15, 3)
    assert points[[10, 13, 14]].ne(0).any(-1).all() and points[:10].eq(0).all()
    assert masked[0, 45:].eq(0).all() and whole[0, 45:68].eq(0.3).all()


def test_hovers_worlds_share_the_modes():
    many = Seen.of(state(7), reference(7), torch.zeros(7, J))
    table = hover_terms.mode_table()
    assert torch.equal(hover_terms.hover_mask(many), table[[0, 1, 2, 3, 4, 0, 1]])
    expected = hover_terms.whole_command(many) * hover_terms.spread(hover_terms.hover_mask(many))
    assert torch.equal(hover_terms.hover_command(many), expected)
    assert hover_terms.hover_mask_all(many).eq(1).all()


def test_hovers_root_command():
    ref = reference(root_quat_w=LEFT, root_lin_vel_w=torch.tensor([[0.0, 1.0, 0.0]]))
    command = hover_terms.root_command(seen(state(root_quat_w=turn_z(3.0)[None]), ref))[0]
    assert torch.allclose(command, torch.tensor([1.0, 0.0, 0.0, 0.0, 0.0, math.pi / 2 - 3.0, 0.8]), atol=1e-5)


@pytest.mark.parametrize("name", BASELINES)
def test_every_term_has_the_size_that_it_says(name: str):
    own = baseline(name)
    for group in (own.env.observation, own.env.student, own.tried or own.env.student):
        names = expanded((*group.terms, *group.now))
        for (term, size), part in zip(parts(names, J, 1), names, strict=True):
            assert see((part,), state(2), reference(2), torch.zeros(2, J)).shape == (2, size), term


def test_an_unknown_baseline_is_one_line():
    with pytest.raises(BadInput, match="baseline: expected omnih2o or exbody2 or hover, came 'h2o'"):
        baseline("h2o")
