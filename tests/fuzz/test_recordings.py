"""Readers of HDF5, LeRobot and ROS 2 recordings against turned bytes: a result or one line of `BadInput`, no more.

HDF5 and ROS 2 are read by libraries of the extra `logs` and skipped without it. Chunks are not packed in the files that
are turned, so that what they hold is turned, too.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee.measured.importers.hdf5_log import import_hdf5
from bumblebee.measured.importers.lerobot import import_lerobot
from bumblebee.measured.importers.map_file import read_map
from bumblebee.measured.importers.ros import import_rosbag
from tests.fuzz.budget import rounds
from tests.fuzz.test_measured import check, mutated
from tests.measured.importers.recordings import (
    HDF5_MAP,
    LEROBOT_MAP,
    joint_messages,
    unitree_messages,
    write_db3,
    write_hdf5,
    write_lerobot,
    write_mcap,
)  # fmt: skip
from tests.measured.simulated import ARM_JOINTS, arm_rollout, g1_rollout

JOINTS = """
joints: [shoulder, elbow, wrist]
time: log
angle_unit: rad
order: {/command: [wrist, elbow, shoulder]}
columns: {joint_pos: /joint_states:position, joint_vel: /joint_states:velocity, joint_target: /command:data}
"""
MOTORS = "layout: unitree_hg\ntime: log\njoints: [a, b, c]\n"
MAPS = {"rosbag": JOINTS, "unitree": MOTORS, "hdf5": HDF5_MAP, "lerobot": LEROBOT_MAP}


def turned_often(tmp_path: Path, name: str, read: object, share: float = 0.08) -> None:
    """Read a file as it is, then with its bytes turned, for a share of the file's seconds."""
    read()  # as it is it can be read
    good = (tmp_path / name).read_bytes()
    for number in rounds(share):
        (tmp_path / name).write_bytes(mutated(np.random.default_rng(number), good))
        check(number, tmp_path, read)


def few(seconds: float = 1.2) -> object:
    rollout = arm_rollout(0, seconds=seconds)
    return replace(rollout, rollout_id="log")


@pytest.mark.parametrize("name", ["run.mcap", "run.db3", "packed.mcap"])
def test_turned_recordings_are_read_or_one_line(tmp_path: Path, name: str) -> None:
    pytest.importorskip("mcap_ros2")
    (tmp_path / "map.yaml").write_text(JOINTS)
    chosen, messages = read_map(tmp_path / "map.yaml", "rosbag"), joint_messages(few(), ARM_JOINTS)
    if name.endswith("db3"):
        write_db3(tmp_path / name, messages, definitions=True)
    else:
        write_mcap(tmp_path / name, messages, "ZSTD" if name.startswith("packed") else "NONE")
    turned_often(tmp_path, name, lambda: import_rosbag(tmp_path / name, chosen))


def test_turned_low_states_are_read_or_one_line(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    (tmp_path / "map.yaml").write_text(MOTORS)
    rollout = g1_rollout(0, seconds=1.2)
    gains = np.full(rollout.joint_pos.shape, 50.0)
    write_mcap(tmp_path / "g1.mcap", unitree_messages(rollout, gains, gains), "NONE")
    chosen = read_map(tmp_path / "map.yaml", "rosbag")
    turned_often(tmp_path, "g1.mcap", lambda: import_rosbag(tmp_path / "g1.mcap", chosen))


def test_turned_hdf5_is_read_or_one_line(tmp_path: Path) -> None:
    pytest.importorskip("h5py")
    (tmp_path / "map.yaml").write_text(HDF5_MAP)
    write_hdf5(tmp_path / "log.h5", [few()], episodes=False)
    chosen = read_map(tmp_path / "map.yaml", "hdf5")
    turned_often(tmp_path, "log.h5", lambda: import_hdf5(tmp_path / "log.h5", chosen))


@pytest.mark.parametrize("name", ["meta/info.json", "data/chunk-000/file-000.parquet"])
def test_turned_lerobot_datasets_are_read_or_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "map.yaml").write_text(LEROBOT_MAP)
    write_lerobot(tmp_path / "set", [few()], ARM_JOINTS, 0.02, "v3.0")
    chosen = read_map(tmp_path / "map.yaml", "lerobot")
    turned_often(tmp_path, f"set/{name}", lambda: import_lerobot(tmp_path / "set", chosen))


@pytest.mark.parametrize("kind", list(MAPS))
def test_turned_maps_are_read_or_one_line(tmp_path: Path, kind: str) -> None:
    (tmp_path / "map.yaml").write_text(MAPS[kind])
    layout = "rosbag" if kind == "unitree" else kind
    turned_often(tmp_path, "map.yaml", lambda: read_map(tmp_path / "map.yaml", layout), 0.04)
