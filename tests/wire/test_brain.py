"""The policy behind its questions: the same wherever the robot booted, the reference beside the wish."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bumblebee import quaternions
from bumblebee.compensation.plan import compensate
from bumblebee.motion.kinematics import forward_key_positions
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.runner import reference_library
from bumblebee.robot.facts import joint_names, stand_pose
from bumblebee.wire.messages import State, layout_of
from bumblebee.wire.policy_end.align import aligned
from bumblebee.wire.policy_end.brain import Brain, OneClip, OneRobot
from bumblebee.wire.policy_end.questions import Question, decode_answer, encode_answer
from tests.policy.conftest import nod
from tests.policy.conftest import policy_folder as policy_folder  # a fixture
from tests.policy.test_compensation import effect
from tests.wire.made import state

TURN = quaternions.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(1.1))
LEAN = quaternions.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(0.1))


def standing(turn: np.ndarray, shift: np.ndarray) -> State:
    """A G1 that leans a little, in a world that is turned and shifted."""
    zero, rng = np.zeros(23), np.random.default_rng(0)
    place = quaternions.rotate(turn, np.array([0.01, -0.02, 0.77])) + shift
    g1 = {"joint_pos": stand_pose() + 0.02 * rng.standard_normal(23), "joint_vel": 0.1 * rng.standard_normal(23)}
    base = {"base_quat": quaternions.multiply(turn, LEAN), "base_pos": place, "base_ang_vel": np.full(3, 0.1)}
    return replace(
        state(joint_torque=zero, temperature=zero, error=zero, **g1, **base), layout=layout_of(joint_names())
    )


def test_forward_kinematics_of_one_robot_are_those_over_a_motion() -> None:
    rng = np.random.default_rng(1)
    pose = rng.standard_normal((1, 3)), quaternions.normalised(rng.standard_normal((1, 4))), rng.uniform(-1, 1, (1, 23))
    np.testing.assert_allclose(OneRobot()(*pose), forward_key_positions(*pose), atol=1e-9)


def test_references_looked_up_before_the_run_are_those_of_the_library(shipped: ExportedPolicy) -> None:
    """Every tick of the clip, the one before it, and those after its end."""
    clip, none = nod(frames=12), torch.zeros(1, dtype=torch.long)
    whole, once = reference_library(shipped, [clip]), OneClip(shipped, clip)
    for tick in range(30):
        time = torch.full((1,), tick / 50)
        for name, value in vars(whole.frames(none, time)).items():
            assert torch.equal(value, getattr(once.frames(none, time), name)), (tick, name)


def test_where_a_robot_booted_and_how_it_was_turned_changes_nothing(shipped: ExportedPolicy) -> None:
    worlds = [(np.array([1.0, 0, 0, 0]), np.zeros(3)), (TURN, np.array([3.0, -2.0, 0.0]))]
    answers = []
    for turn, shift in worlds:
        brain, seen = Brain(shipped, nod()), standing(turn, shift)
        answers.append([brain.answer(Question(tick, 0, seen)) for tick in range(3)])
    for one, other in zip(*answers, strict=True):
        np.testing.assert_allclose(one.wish.target, other.wish.target, atol=1e-4)
        np.testing.assert_allclose(quaternions.multiply(TURN, one.reference.quat), other.reference.quat, atol=1e-6)
        assert one.reference.height == other.reference.height == pytest.approx(0.78, abs=0.02)
    assert np.abs(answers[0][2].action).max() > 0.01


def test_a_clip_begins_where_the_robot_is_but_for_its_height_and_lean() -> None:
    clip = nod()
    seen = standing(TURN, np.array([3.0, -2.0, 0.1]))
    into = aligned(seen.base_pos, seen.base_quat, clip.root_pos[0], clip.root_quat[0])
    pos, quat = into.seen(seen.base_pos, seen.base_quat)
    np.testing.assert_allclose(pos, [*clip.root_pos[0, :2], seen.base_pos[2]], atol=1e-6)
    np.testing.assert_allclose(quat, LEAN, atol=1e-6)
    np.testing.assert_allclose(into.back(quat), seen.base_quat, atol=1e-9)


def test_a_policy_that_does_nothing_wants_the_references_targets(policy_folder: Callable[..., Path]) -> None:
    brain = Brain(ExportedPolicy.load(policy_folder(gain=0.0)), nod())
    answer = brain.answer(Question(4, 9, standing(TURN, np.zeros(3))))
    np.testing.assert_allclose(answer.wish.target, answer.reference.target, atol=1e-6)
    read = decode_answer(encode_answer(answer), 23)
    assert (read.tick, read.asked_ns, read.sequence) == (4, 9, 7)
    for one, other in zip(vars(answer.wish).values(), vars(read.wish).values(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_what_a_compensation_undoes_goes_out_with_the_wish(policy_folder: Callable[..., Path]) -> None:
    knee = joint_names().index("left_knee_joint")
    policy = ExportedPolicy.load(policy_folder(gain=0.0))
    effects = [effect("motor_strength", "left_knee_joint", 0.8), effect("encoder_offset", "left_knee_joint", 0.1)]
    seen = standing(TURN, np.zeros(3))
    plain, undone = (Brain(policy, nod(), c).answer(Question(0, 0, seen)) for c in (None, compensate(effects)))
    assert undone.wish.kp[knee] == pytest.approx(plain.wish.kp[knee] / 0.8)
    assert undone.wish.target[knee] - plain.wish.target[knee] == pytest.approx(0.1, abs=1e-6)
    assert undone.reference.target[knee] - plain.reference.target[knee] == pytest.approx(0.1, abs=1e-6)
