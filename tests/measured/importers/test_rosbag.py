"""ROS 2 recordings give back the rollout that was recorded; what a map or a file leaves open is one line."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.importers import read_rollouts
from bumblebee.measured.rollout import Rollout
from bumblebee.robot.facts import joint_names
from tests.measured.importers.recordings import (
    ARM_MAP,
    SAME_CLOCK,
    header,
    joint_messages,
    stamps_ns,
    unitree_messages,
    write_db3,
    write_mcap,
)  # fmt: skip
from tests.measured.simulated import ARM_JOINTS, arm_rollout, g1_rollout

pytest.importorskip("mcap_ros2")


def imported(folder: Path, name: str, text: str) -> list[Rollout]:
    (folder / "map.yaml").write_text(text)
    return read_rollouts(folder / name, "rosbag", column_map=folder / "map.yaml")


def same(ours: Rollout, theirs: Rollout, rows: slice = slice(None), columns: tuple[str, ...] = ()) -> None:
    np.testing.assert_allclose(ours.time - ours.time[0], theirs.time[rows] - theirs.time[rows][0], atol=2e-9)
    for column in columns or ("joint_pos", "joint_vel", "joint_target"):
        np.testing.assert_allclose(getattr(ours, column), getattr(theirs, column)[rows], atol=1e-6, err_msg=column)


@pytest.mark.parametrize("kind", ["ZSTD", "LZ4", "NONE", "db3", "db3 with definitions"])
def test_joints_are_found_by_name_and_targets_by_the_order_that_the_map_states(tmp_path: Path, kind: str) -> None:
    rollout, name = arm_rollout(0), "run.db3" if "db3" in kind else "run.mcap"
    if "db3" in kind:
        write_db3(tmp_path / name, joint_messages(rollout, ARM_JOINTS), "definitions" in kind)
    else:
        write_mcap(tmp_path / name, joint_messages(rollout, ARM_JOINTS), kind)
    (ours,) = imported(tmp_path, name, SAME_CLOCK)
    same(ours, rollout)
    assert (ours.rollout_id, ours.joints, ours.control_hz) == ("run", ARM_JOINTS, rollout.control_hz)
    assert ours.meta["recorded_at"].startswith("2023-11-14")


def test_with_other_clocks_the_command_that_the_recorder_had_by_then_is_in_force(tmp_path: Path) -> None:
    """The recorder is 3 ms later than the headers: each command is in force from the next row on."""
    rollout = arm_rollout(0)
    write_mcap(tmp_path / "run.mcap", joint_messages(rollout, ARM_JOINTS))
    (ours,) = imported(tmp_path, "run.mcap", ARM_MAP)
    np.testing.assert_allclose(ours.joint_pos, rollout.joint_pos[1:])
    np.testing.assert_allclose(ours.joint_target, rollout.joint_target[:-1])


def test_names_of_the_messages_are_said_beside_the_model_s(tmp_path: Path) -> None:
    rollout = arm_rollout(0)
    write_mcap(tmp_path / "run.mcap", joint_messages(rollout, ("j1", "j2", "j3")))
    with pytest.raises(BadInput, match=r"joint shoulder.*j3, j2, j1.*names"):
        imported(tmp_path, "run.mcap", SAME_CLOCK)
    (ours,) = imported(tmp_path, "run.mcap", SAME_CLOCK + "names: [j1, j2, j3]\n")
    same(ours, rollout)


def test_a_bag_in_parts_is_one_rollout(tmp_path: Path) -> None:
    rollout = arm_rollout(0)
    messages, bag = joint_messages(rollout, ARM_JOINTS), tmp_path / "walk"
    bag.mkdir()
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    write_mcap(bag / "walk_0.mcap", messages[:301])
    write_mcap(bag / "walk_1.mcap", messages[301:])
    (ours,) = imported(tmp_path, "walk", SAME_CLOCK)
    assert ours.rollout_id == "walk"
    same(ours, rollout)


def test_unitree_s_low_states_and_commands_give_a_rollout_for_each_set_of_gains(tmp_path: Path) -> None:
    """The feed-forward torque becomes part of the target; the ramp of the gains is left out."""
    rollout = g1_rollout(0, seconds=4.0)
    rows, joints = rollout.joint_pos.shape
    ramp = np.clip((np.arange(rows) - 75) / 25, 0, 1)[:, None]
    kp = (20 + 40 * ramp) * np.ones((rows, joints))
    write_mcap(tmp_path / "g1.mcap", unitree_messages(rollout, kp, 0.05 * kp))
    motors = ", ".join(joint_names())
    first, second = imported(tmp_path, "g1.mcap", f"layout: unitree_hg\ntime: log\njoints: [{motors}]\n")
    columns = ("joint_pos", "joint_vel", "joint_target", "base_quat", "base_ang_vel")
    same(first, rollout, slice(0, 76), columns)
    same(second, rollout, slice(100, rows), columns)
    assert first.meta["kp"] == [20.0] * 23 and second.meta["kd"] == [3.0] * 23
    assert "24 rows" in first.meta["notes"] and (first.joint_torque == 1.5).all()


def test_motors_that_the_model_has_not_are_left_out_and_ankles_driven_apart_are_refused(tmp_path: Path) -> None:
    rollout = g1_rollout(0, seconds=1.2)
    gains = np.full(rollout.joint_pos.shape, 50.0)
    write_mcap(tmp_path / "g1.mcap", unitree_messages(rollout, gains, gains))
    names = [name if place not in (1, 3) else "_" for place, name in enumerate(joint_names())]
    (ours,) = imported(tmp_path, "g1.mcap", f"layout: unitree_hg\ntime: log\njoints: [{', '.join(names)}]\n")
    assert ours.joints == tuple(name for name in names if name != "_") and len(ours.meta["kp"]) == 21
    np.testing.assert_allclose(ours.joint_pos, np.delete(rollout.joint_pos, [1, 3], axis=1), atol=1e-6)
    write_mcap(tmp_path / "g1.mcap", unitree_messages(rollout, gains, gains, mode=1))
    with pytest.raises(BadInput, match=r"mode_pr.*pitch and roll.*came 1"):
        imported(tmp_path, "g1.mcap", f"layout: unitree_hg\ntime: log\njoints: [{', '.join(names)}]\n")


def test_a_trajectory_s_points_and_an_imu_with_named_components_are_read(tmp_path: Path) -> None:
    rollout = arm_rollout(0, seconds=1.2)
    messages = []
    for k, stamp in enumerate(stamps_ns(rollout.time).tolist()):
        point = SimpleNamespace(
            positions=rollout.joint_target[k].tolist(), velocities=[], accelerations=[], effort=[],
            time_from_start=SimpleNamespace(sec=0, nanosec=0),
        )  # fmt: skip
        plan = SimpleNamespace(header=header(stamp), joint_names=list(ARM_JOINTS), points=[point])
        axes = SimpleNamespace(x=0.1, y=0.2, z=0.3)
        turn = SimpleNamespace(x=0.0, y=0.0, z=0.6, w=0.8)
        imu = SimpleNamespace(
            header=header(stamp), orientation=turn, orientation_covariance=[0.0] * 9, angular_velocity=axes,
            angular_velocity_covariance=[0.0] * 9, linear_acceleration=axes, linear_acceleration_covariance=[0.0] * 9,
        )  # fmt: skip
        messages += [
            ("/plan", "trajectory_msgs/msg/JointTrajectory", stamp, plan),
            ("/imu", "sensor_msgs/msg/Imu", stamp, imu),
        ]
    write_mcap(tmp_path / "run.mcap", messages + joint_messages(rollout, ARM_JOINTS))
    text = SAME_CLOCK.replace("/command:data", "/plan:points[0].positions")
    text = text.replace("columns:", "columns:\n  base_quat: /imu:orientation\n  base_ang_vel: /imu:angular_velocity")
    for order in ("wxyz", "xyzw"):
        (ours,) = imported(tmp_path, "run.mcap", f"{text}quat_order: {order}\n")
        same(ours, rollout)
        assert ours.base_quat[0].tolist() == [0.8, 0.0, 0.0, 0.6] and ours.base_ang_vel[5].tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (("angle_unit: rad\n", ""), r"angle_unit.*nothing.*not guessed"),
        (("time: log\n", ""), r"time: .*header or log.*nothing"),
        (("order: {/command: [wrist, elbow, shoulder]}\n", ""), r"order.*/command's 3 values.*nothing stated"),
        (("[wrist, elbow, shoulder]", "[elbow, shoulder]"), r"order.*/command's 3 values.*came elbow, shoulder"),
        (("time: log", "time: header"), r"/command.*a header.*time: log"),
        (("/command:data", "/cmd:data"), r"/cmd.*messages of this topic.*/command \(std_msgs"),
        (("/joint_states:velocity", "/joint_states:effort"), r"joint_vel.*3 values.*came 0.*out of the map"),
        (("/joint_states:velocity", "/joint_states:speed"), r"speed.*this field.*only header, name"),
        (("/joint_states:velocity", "velocity"), r"topic:field"),
        (("/joint_states:velocity", "/joint_states:header.stamp"), r"numbers"),
        (("elbow, wrist]\n", "elbow, hand]\n"), r"joint hand"),
    ],
)  # fmt: skip
def test_what_a_map_leaves_open_or_a_recording_lacks_is_one_line(
    tmp_path: Path, change: tuple[str, str], named: str
) -> None:
    write_mcap(tmp_path / "run.mcap", joint_messages(arm_rollout(0, seconds=1.2), ARM_JOINTS))
    assert change[0] in SAME_CLOCK
    with pytest.raises(BadInput, match=named) as error:
        imported(tmp_path, "run.mcap", SAME_CLOCK.replace(*change))
    assert "\n" not in str(error.value)


def test_commands_that_come_once_are_held(tmp_path: Path) -> None:
    rollout = arm_rollout(0, seconds=1.2)
    messages = joint_messages(rollout, ARM_JOINTS)
    write_mcap(tmp_path / "run.mcap", [m for k, m in enumerate(messages) if m[0] != "/command" or k == 20])
    (ours,) = imported(tmp_path, "run.mcap", SAME_CLOCK)
    same(replace(ours, joint_target=ours.joint_pos), rollout, slice(10, None), ("joint_pos",))
    np.testing.assert_allclose(ours.joint_target, np.tile(rollout.joint_target[10], (ours.frames, 1)))
