"""Joints that come in messages apart are one robot's; two publishers of one joint are told apart."""

from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.importers import read_rollouts
from bumblebee.measured.rollout import Rollout
from tests.measured.importers.recordings import SAME_CLOCK, joint_messages, write_mcap
from tests.measured.importers.remedies.recordings import Messages, state, with_other
from tests.measured.simulated import ARM_JOINTS, arm_rollout

pytest.importorskip("mcap_ros2")

LATER = 3_000_000  # [ns] after the arm's message comes the gripper's


def imported(folder: Path, messages: Messages, more: str = "", text: str = SAME_CLOCK) -> Rollout:
    write_mcap(folder / "run.mcap", messages)
    (folder / "map.yaml").write_text(text + more)
    (rollout,) = read_rollouts(folder / "run.mcap", "rosbag", column_map=folder / "map.yaml")
    return rollout


def apart(messages: Messages) -> Messages:
    """The wrist's state comes in a message of its own, 3 ms after the other joints'."""
    out = []
    for topic, kind, stamp, m in messages:
        if topic != "/joint_states":
            out.append((topic, kind, stamp, m))
            continue
        places = [m.name.index(name) for name in ARM_JOINTS]
        for chosen, late in ((places[:2], 0), (places[2:], LATER)):
            part = ([values[p] for p in chosen] for values in (m.name, m.position, m.velocity))
            out.append((topic, kind, stamp + late, state(stamp + late, *part, [])))
    return out


def test_parts_of_a_state_are_put_together_by_name_each_at_its_own_stamp(tmp_path: Path) -> None:
    """Rows are the stamps of the part with most joints; the wrist is interpolated, as it was sampled 3 ms later."""
    rollout = arm_rollout(0)
    ours = imported(tmp_path, apart(joint_messages(rollout, ARM_JOINTS)))
    assert ours.joints == ARM_JOINTS
    np.testing.assert_allclose(ours.joint_pos[:, :2], rollout.joint_pos[1:, :2], atol=1e-9)
    share = LATER * 1e-9 * rollout.control_hz
    wrist = share * rollout.joint_pos[:-1, 2] + (1 - share) * rollout.joint_pos[1:, 2]
    np.testing.assert_allclose(ours.joint_pos[:, 2], wrist, atol=1e-9)
    assert "put together from messages with [shoulder, elbow] and with [wrist]" in ours.meta["notes"]


def test_of_two_publishers_the_one_that_the_map_names_is_read_and_the_other_noted(tmp_path: Path) -> None:
    messages = with_other(["elbow", "shoulder", "wrist"])
    with pytest.raises(BadInput, match=r"/joint_states: expected messages of one publisher for each joint"):
        imported(tmp_path, messages)
    order = "order: {/command: [wrist, elbow, shoulder], /joint_states: [wrist, elbow, shoulder]}\n"
    ours = imported(tmp_path, messages, order, SAME_CLOCK.partition("order:")[0])
    np.testing.assert_allclose(ours.joint_pos, arm_rollout(0, seconds=1.2).joint_pos)
    assert "60 messages with elbow, shoulder, wrist left out, of another publisher" in ours.meta["notes"]


def test_messages_that_lack_what_others_with_the_same_names_have_are_another_publisher_s(tmp_path: Path) -> None:
    ours = imported(tmp_path, with_other(list(ARM_JOINTS)[::-1]))
    np.testing.assert_allclose(ours.joint_pos, arm_rollout(0, seconds=1.2).joint_pos)
    assert "left out, of another publisher" in ours.meta["notes"]


def with_wheels(rollout: Rollout) -> Messages:
    """On the arm's topic come states of two wheels, too, without velocities."""
    arm = joint_messages(rollout, ARM_JOINTS)
    wheels = [
        ("/joint_states", "sensor_msgs/msg/JointState", 5 + stamp, state(stamp, ["left", "right"], [1.0, 2.0], [], []))
        for _, _, stamp, _ in arm[::2]
    ]
    return sorted([*arm, *wheels], key=lambda message: message[2])


def test_messages_of_other_joints_than_the_map_s_change_nothing(tmp_path: Path) -> None:
    rollout = arm_rollout(0, seconds=1.2)
    np.testing.assert_allclose(imported(tmp_path, with_wheels(rollout)).joint_pos, rollout.joint_pos)


def test_a_joint_that_is_given_by_its_place_in_messages_of_two_kinds_is_refused(tmp_path: Path) -> None:
    text = """
joints: [wrist, elbow]
time: log
angle_unit: rad
order: {/command: [wrist, elbow, _]}
columns: {joint_pos: ['/joint_states:position[0]', '/joint_states:position[1]'], joint_target: /command:data}
"""
    with pytest.raises(BadInput, match="joint_pos: expected each joint once, came joint wrist twice"):
        imported(tmp_path, with_wheels(arm_rollout(0, seconds=1.2)), "", text)
