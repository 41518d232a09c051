"""Several takes in one file are told apart and never sorted into one another."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.importers import read_rollouts
from bumblebee.measured.importers.clock import restarts, takes
from bumblebee.measured.rollout import Rollout
from tests.measured.importers.recordings import SAME_CLOCK, joint_messages, write_lerobot, write_mcap
from tests.measured.importers.remedies.recordings import set_back
from tests.measured.simulated import ARM_JOINTS, arm_rollout

LEROBOT = "joints: [shoulder, elbow, wrist, _]\nangle_unit: rad\n"


def imported(folder: Path, name: str, kind: str, text: str) -> list[Rollout]:
    (folder / "map.yaml").write_text(text)
    return read_rollouts(folder / name, kind, column_map=folder / "map.yaml")


def test_time_starts_again_where_two_rows_are_older_than_one_before_them() -> None:
    clock = np.arange(10.0)
    assert restarts(clock) == [] and restarts(np.full(5, 2.0)) == []
    assert restarts(np.array([0, 1, 3, 2, 4, 5.0])) == []  # one that came late
    assert restarts(np.concatenate((clock, clock, clock - 3))) == [10, 20]
    assert [(part.start, part.stop) for part in takes(np.concatenate((clock, clock + 99)))] == [(0, 10), (10, 20)]


def test_a_retake_within_an_episode_is_two_rollouts(tmp_path: Path) -> None:
    write_lerobot(tmp_path / "set", [arm_rollout(0), arm_rollout(1)], ARM_JOINTS, 1.0, "v2.1")
    place = tmp_path / "set" / "data" / "chunk-000" / "episode_000001.parquet"
    table = pd.read_parquet(place)
    again = np.concatenate((table["timestamp"][:100], table["timestamp"][:200])).astype(np.float32)
    table.assign(timestamp=again).to_parquet(place)
    with pytest.raises(BadInput, match=r"row 100: .* time that starts again .* 2 takes in one file.*`episodes: split`"):
        imported(tmp_path, "set", "lerobot", LEROBOT)
    found = imported(tmp_path, "set", "lerobot", LEROBOT + "episodes: split\n")
    assert [(one.rollout_id, one.frames) for one in found] == [
        ("episode_0000", 300), ("episode_0001_1", 100), ("episode_0001_2", 200),
    ]  # fmt: skip
    np.testing.assert_allclose(found[2].joint_pos, arm_rollout(1).joint_pos[100:], atol=1e-6)


def test_halves_of_a_recording_whose_clock_was_set_back_are_not_put_into_one_another(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    rollout = arm_rollout(0, seconds=3.0)
    write_mcap(tmp_path / "run.mcap", set_back(joint_messages(rollout, ARM_JOINTS)))
    with pytest.raises(BadInput, match=r"a step of -1.38 s at message 75.*`episodes: split`"):
        imported(tmp_path, "run.mcap", "rosbag", SAME_CLOCK)
    first, second = imported(tmp_path, "run.mcap", "rosbag", SAME_CLOCK + "episodes: split\n")
    np.testing.assert_allclose(np.concatenate((first.joint_pos, second.joint_pos)), rollout.joint_pos)
    np.testing.assert_allclose(np.concatenate((first.joint_target, second.joint_target)), rollout.joint_target)


def test_a_message_that_came_late_is_sorted_and_noted(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    messages = joint_messages(arm_rollout(0, seconds=1.2), ARM_JOINTS)
    messages[21], messages[23] = messages[23], messages[21]
    write_mcap(tmp_path / "run.mcap", messages)
    (ours,) = imported(tmp_path, "run.mcap", "rosbag", SAME_CLOCK)
    np.testing.assert_allclose(ours.joint_pos, arm_rollout(0, seconds=1.2).joint_pos)
    assert "/joint_states: 1 messages older than the one before, sorted" in ours.meta["notes"]
