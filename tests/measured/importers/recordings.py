"""A rollout of the simulated arm or G1 written as other groups write theirs, by the libraries that they use."""

import json
import sqlite3
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.measured.importers.ros.types import TYPES
from bumblebee.measured.rollout import Rollout

HDF5_MAP = """
joints: [shoulder, elbow, wrist]
time: stamp
time_unit: ms
angle_unit: deg
columns: {joint_pos: obs/q, joint_vel: obs/dq, joint_target: action}
"""
LEROBOT_MAP = "joints: [shoulder, elbow, wrist, _]\nangle_unit: deg\n"

START = 1_700_000_000 * 10**9  # [ns] of the first row's header
LOGGED = 3_000_000  # [ns] later the recorder writes it

ARM_MAP = """
joints: [shoulder, elbow, wrist]
time: {/joint_states: header, /command: log}
angle_unit: rad
columns:
  joint_pos: /joint_states:position
  joint_vel: /joint_states:velocity
  joint_target: /command:data
order: {/command: [wrist, elbow, shoulder]}
"""
SAME_CLOCK = ARM_MAP.replace("{/joint_states: header, /command: log}", "log")


def stamps_ns(time: np.ndarray) -> np.ndarray:
    """Stamps [ns] of a rollout's time [s]."""
    return START + np.round((time - time[0]) * 1e9).astype(np.int64)


def header(stamp: int) -> Any:
    """A std_msgs/Header."""
    whole, rest = divmod(int(stamp), 10**9)
    return SimpleNamespace(stamp=SimpleNamespace(sec=whole, nanosec=rest), frame_id="")


def joint_messages(rollout: Rollout, names: tuple[str, ...]) -> list[tuple[str, str, int, Any]]:
    """Topic, type, stamp and message: states as JointState in another order of joints, targets without names."""
    out = []
    turned = list(reversed(range(len(names))))
    for k, stamp in enumerate(stamps_ns(rollout.time).tolist()):
        state = SimpleNamespace(
            header=header(stamp),
            name=[names[j] for j in turned],
            position=rollout.joint_pos[k][turned].tolist(),
            velocity=rollout.joint_vel[k][turned].tolist(),
            effort=[],
        )
        command = SimpleNamespace(
            layout=SimpleNamespace(dim=[], data_offset=0), data=rollout.joint_target[k][turned].tolist()
        )
        out.append(("/command", "std_msgs/msg/Float64MultiArray", stamp, command))
        out.append(("/joint_states", "sensor_msgs/msg/JointState", stamp, state))
    return out


def unitree_messages(
    rollout: Rollout, kp: np.ndarray, kd: np.ndarray, mode: int = 0
) -> list[tuple[str, str, int, Any]]:
    """Low states and commands of a rollout; kp, kd (T, J). A third of the torque is commanded as feed-forward."""
    out, joints = [], rollout.joint_pos.shape[1]
    blank = [0] * 4
    still = {"mode": 1, "ddq": 0.0, "temperature": [30, 30], "vol": 50.0, "sensor": [0, 0], "motorstate": 0}
    empty = {"q": 0.0, "dq": 0.0, "tau_est": 0.0}
    for k, stamp in enumerate(stamps_ns(rollout.time).tolist()):
        measured = [
            {"q": q, "dq": v, "tau_est": 1.5}
            for q, v in zip(rollout.joint_pos[k].tolist(), rollout.joint_vel[k].tolist(), strict=True)
        ]
        motors = [SimpleNamespace(**still, reserve=blank, **one) for one in measured + [empty] * (35 - joints)]
        imu = SimpleNamespace(
            quaternion=rollout.base_quat[k].tolist(), gyroscope=rollout.base_ang_vel[k].tolist(),
            accelerometer=[0.0] * 3, rpy=[0.0] * 3, temperature=30,
        )  # fmt: skip
        state = SimpleNamespace(
            version=[1, 0], mode_pr=mode, mode_machine=5, tick=k, imu_state=imu, motor_state=motors,
            wireless_remote=[0] * 40, reserve=blank, crc=0,
        )  # fmt: skip
        commands = [
            SimpleNamespace(mode=1, q=q - 0.3 / p if p else q, dq=0.0, tau=0.3 if p else 0.0, kp=p, kd=d, reserve=0)
            for q, p, d in zip(rollout.joint_target[k].tolist(), kp[k].tolist(), kd[k].tolist(), strict=True)
        ]
        commands += [SimpleNamespace(mode=0, q=0.0, dq=0.0, tau=0.0, kp=0.0, kd=0.0, reserve=0)] * (35 - joints)
        command = SimpleNamespace(mode_pr=mode, mode_machine=5, motor_cmd=commands, reserve=blank, crc=0)
        out.append(("/lowstate", "unitree_hg/msg/LowState", stamp, state))
        out.append(("/lowcmd", "unitree_hg/msg/LowCmd", stamp, command))
    return out


def write_mcap(
    path: Path, messages: list[tuple[str, str, int, Any]], compression: str = "ZSTD", chunk: int = 1 << 13
) -> None:
    """A recording as ROS 2 Iron and later write it, in chunks of so many bytes."""
    from mcap.writer import CompressionType
    from mcap_ros2.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType[compression], chunk_size=chunk)
        schemas = {kind: writer.register_msgdef(kind, TYPES[kind]) for kind in {kind for _, kind, _, _ in messages}}
        for topic, kind, stamp, message in messages:
            writer.write_message(topic, schemas[kind], message, log_time=stamp + LOGGED, publish_time=stamp + 1)
        writer.finish()


def write_db3(path: Path, messages: list[tuple[str, str, int, Any]], definitions: bool = False) -> None:
    """A recording as ROS 2 until Humble writes it; with `definitions` as since Iron."""
    from mcap_ros2.writer import serialize_dynamic

    base = sqlite3.connect(path)
    base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
    base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    numbers: dict[str, int] = {}
    encoders = {}
    if definitions:
        base.execute(
            "CREATE TABLE message_definitions(id INTEGER, topic_type TEXT, encoding TEXT, "
            "encoded_message_definition TEXT)"
        )
    for topic, kind, stamp, message in messages:
        if topic not in numbers:
            numbers[topic] = len(numbers) + 1
            encoders[topic] = serialize_dynamic(kind, TYPES[kind])[kind]
            base.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr')", (numbers[topic], topic, kind))
            if definitions:
                text = TYPES[kind]
                base.execute("INSERT INTO message_definitions VALUES (1, ?, 'ros2msg', ?)", (kind, text))
        data = encoders[topic](message)
        row = (numbers[topic], int(stamp) + LOGGED, data)
        base.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", row)
    base.commit()
    base.close()


def write_hdf5(path: Path, rollouts: list[Rollout], episodes: bool) -> None:
    """Degrees and milliseconds; a group an episode, or one rollout at the top."""
    import h5py

    with h5py.File(path, "w") as file:
        for number, rollout in enumerate(rollouts):
            group = file.create_group(f"data/demo_{number}") if episodes else file
            group["obs/q"] = np.rad2deg(rollout.joint_pos)
            group["obs/dq"] = np.rad2deg(rollout.joint_vel)
            group.create_dataset("action", data=np.rad2deg(rollout.joint_target), compression="gzip")
            group["stamp"] = 1e3 * rollout.time


def write_lerobot(folder: Path, rollouts: list[Rollout], names: tuple[str, ...], unit: float, version: str) -> None:
    """Episodes below each other (v3) or a file each (v2), joints in units of `unit` rad, a gripper at the end."""
    (folder / "meta" / "episodes" / "chunk-000").mkdir(parents=True)
    feature = {"dtype": "float32", "shape": [len(names) + 1], "names": [*(f"{name}.pos" for name in names), "gripper"]}
    fps = rollouts[0].control_hz
    info = {"codebase_version": version, "robot_type": "arm", "fps": fps, "features": {}}
    info["features"] = {"observation.state": feature, "action": feature, "timestamp": {"shape": [1], "names": None}}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    tables = []
    for number, rollout in enumerate(rollouts):
        hand = np.full((rollout.frames, 1), 7.0)
        tables.append(
            pd.DataFrame({
                "observation.state": list(np.hstack((rollout.joint_pos / unit, hand)).astype(np.float32)),
                "action": list(np.hstack((rollout.joint_target / unit, hand)).astype(np.float32)),
                "timestamp": (np.arange(rollout.frames) / fps).astype(np.float32),
                "episode_index": number,
            })
        )  # fmt: skip
    tables[0].iloc[:1].to_parquet(folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet")
    chunk = folder / "data" / "chunk-000"
    chunk.mkdir(parents=True)
    if version.startswith("v3"):
        pd.concat(tables).to_parquet(chunk / "file-000.parquet")
    else:
        for number, table in enumerate(tables):
            table.to_parquet(chunk / f"episode_{number:06d}.parquet")
