"""Logs as labs write them: other separators, lists in cells, missing velocities, one file instead of a folder."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.importers import read_rollouts
from bumblebee.measured.rollout import Rollout
from tests.measured.test_importers import JOINTS, so101_folder

ROWS = np.arange(60) * 0.02
WAYS = np.stack((0.3 * np.sin(3 * ROWS), 0.2 * np.cos(2 * ROWS)), axis=1)
RATES = np.stack((0.9 * np.cos(3 * ROWS), -0.4 * np.sin(2 * ROWS)), axis=1)
SMALL_MAP = "joints: [a, b]\ncolumns: {joint_pos: [q1, q2], joint_target: [u1, u2]}\n"


def written(folder: Path, text: str, columns: str = SMALL_MAP) -> list[Rollout]:
    (folder / "log.csv").write_text(text)
    (folder / "map.yaml").write_text(columns)
    return read_rollouts(folder / "log.csv", "csv", column_map=folder / "map.yaml")


def lines(separator: str = ",", point: str = ".") -> str:
    rows = [[t, *q, *q] for t, q in zip(ROWS, WAYS, strict=True)]
    body = [separator.join(f"{x:.6f}".replace(".", point) for x in row) for row in rows]
    return "\n".join([separator.join(("time", "q1", "q2", "u1", "u2")), *body]) + "\n"


@pytest.mark.parametrize(("separator", "point"), [(",", "."), (";", "."), ("\t", "."), (";", ",")])
def test_velocities_that_were_not_logged_are_differences_whatever_separates_the_cells(
    tmp_path: Path, separator: str, point: str
) -> None:
    (rollout,) = written(tmp_path, lines(separator, point))
    np.testing.assert_allclose(rollout.joint_pos, WAYS, atol=1e-6)
    np.testing.assert_allclose(rollout.joint_vel[1:-1], RATES[1:-1], atol=1e-3)
    assert "not logged" in rollout.meta["notes"]


def test_a_byte_order_mark_and_rows_of_separators_are_no_data(tmp_path: Path) -> None:
    (rollout,) = written(tmp_path, "\ufeff" + lines() + ",,,,\n,,,,\n")
    assert rollout.frames == len(ROWS)


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_lists_in_cells_scales_and_episodes_of_one_file(tmp_path: Path, kind: str) -> None:
    """As LeRobot's tables are: states and actions as lists, no velocities, episodes one below the other."""
    columns = (
        "joints: [a, b]\ntime: timestamp\nangle_unit: deg\nepisode: episode_index\nscale: {joint_pos: [1, -1]}\n"
        "offset: {joint_pos: 0.1}\ncolumns: {joint_pos: observation.state, joint_target: action}\n"
    )
    degrees = np.rad2deg(WAYS)
    table = pd.DataFrame({
        "timestamp": np.tile(ROWS, 2), "episode_index": np.repeat([3, 4], len(ROWS)),
        "observation.state": [*degrees, *degrees], "action": [*degrees, *degrees],
    })  # fmt: skip
    if kind == "csv":
        for name in ("observation.state", "action"):
            table[name] = [json.dumps(list(row)) for row in table[name]]
        table.to_csv(tmp_path / "log.csv", index=False)
    else:
        table.to_parquet(tmp_path / "log.parquet")
    (tmp_path / "map.yaml").write_text(columns)
    first, second = read_rollouts(tmp_path / f"log.{kind}", "csv", column_map=tmp_path / "map.yaml")
    assert (first.rollout_id, second.rollout_id) == ("log_0003", "log_0004")
    np.testing.assert_allclose(second.joint_pos, WAYS * [1, -1] + 0.1, atol=1e-9)
    np.testing.assert_allclose(second.joint_target, WAYS, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "columns", "named"),
    [
        ("time,q1,q2,u1,u2\n", SMALL_MAP, "rows under the header"),
        ("time,q1,q2,u1,u2\n0,1,1,1,1\n", SMALL_MAP.replace("[q1, q2]", "q1"), "2 columns"),
        ("time,q,u1,u2\n0,\"[1, 2, 3]\",1,1\n", SMALL_MAP.replace("[q1, q2]", "q"), "row 0.*2 values"),
        ("time,q1,q2,u1,u2\n0,1,1,1,1\n", SMALL_MAP.replace("joint_pos", "joint_vel"), "joint_pos"),
        ("time,q1,q2,u1,u2\n0,1,1,1,1\n", SMALL_MAP + "meta: text\n", "meta"),
        ("time,q1,q2,u1,u2\n0,1,1,1,1\n", SMALL_MAP + "scale: {joint_pos: [1, 2, 3]}\n", "1 or 2 numbers"),
        ("time,q1,q2,u1,u2\n0,1,1,1,1\n", SMALL_MAP.replace("[a, b]", "[a, a]"), "each once"),
    ],
)  # fmt: skip
def test_what_a_table_lacks_is_named(tmp_path: Path, text: str, columns: str, named: str) -> None:
    with pytest.raises(BadInput, match=named):
        written(tmp_path, text, columns)


def two_joints() -> mujoco.MjModel:
    drives = '<actuator><motor name="ma" joint="a" gear="3" ctrlrange="-20 20" ctrllimited="true"/></actuator>'
    body = '<body><joint name="{}" axis="0 1 0"/><geom size=".1" mass="1"/>{}</body>'
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{body.format('a', body.format('b', ''))}</worldbody>{drives}</mujoco>"
    )


def test_a_single_npz_is_one_log_though_it_is_an_archive_inside(tmp_path: Path) -> None:
    """With PACE's names, an environment's axis and one gain for all; velocities are differences."""
    np.savez(tmp_path / "log.npz", time=ROWS[:, None], dof_pos=WAYS[:, None], des_dof_pos=WAYS[:, None], kp=50.0)
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint name='a'/><geom size='.1'/><body><joint name='b'/><geom size='.1'/></body>"
        "</body></worldbody><actuator><position joint='a'/><position joint='b'/></actuator></mujoco>"
    )
    (rollout,) = read_rollouts(tmp_path / "log.npz", "asap", model)
    np.testing.assert_allclose(rollout.joint_vel[1:-1], RATES[1:-1], atol=1e-3)
    assert rollout.meta["kp"] == [50.0, 50.0] and "not logged" in rollout.meta["notes"]
    np.savez(tmp_path / "log.npz", time=ROWS, dof_pos=WAYS, des_dof_pos=WAYS, kp=np.ones(5))
    with pytest.raises(BadInput, match="kp"):
        read_rollouts(tmp_path / "log.npz", "asap", model)


def test_a_joint_without_a_drive_is_taken_from_sysid_s_states_while_both_are_logged(tmp_path: Path) -> None:
    """One motor with a gear, its control a plain row of numbers; states begin later and end earlier than controls."""
    mapping = json.dumps({"a_qpos": [2, [0]], "b_qpos": [2, [1]], "a_qvel": [3, [2]], "b_qvel": [3, [3]]})
    states = np.concatenate((WAYS, RATES), axis=1)
    np.savez(
        tmp_path / "swing.npz", control_times=ROWS, control_data=np.arange(60.0), state_times=ROWS[5:50] + 0.004,
        state_data=states[5:50], state_signal_mapping=mapping,
    )  # fmt: skip
    (rollout,) = read_rollouts(tmp_path / "swing.npz", "sysid", two_joints())
    assert rollout.joints == ("a", "b") and rollout.frames == 44
    assert rollout.joint_torque_cmd[0].tolist() == [18.0, 0.0] and rollout.joint_torque_cmd[-1].tolist() == [60.0, 0.0]
    assert rollout.time[0] == ROWS[6] and rollout.time[-1] == ROWS[49]


def test_a_joint_list_may_have_commas_and_velocities_may_be_missing(tmp_path: Path) -> None:
    so101_folder(tmp_path / "wave")
    (tmp_path / "wave" / "joint_list.txt").write_text('["Rotation", "Jaw"]\n')
    state = (tmp_path / "wave" / "state_motor.csv").read_text().replace("velocities", "currents")
    (tmp_path / "wave" / "state_motor.csv").write_text(state)
    (rollout,) = read_rollouts(tmp_path, "so101")
    assert rollout.joints == JOINTS and "not logged" in rollout.meta["notes"]
    np.testing.assert_allclose(rollout.joint_vel, np.gradient(rollout.joint_pos, rollout.time, axis=0))


def test_stamps_in_seconds_and_nanoseconds_keep_every_digit(tmp_path: Path) -> None:
    """As ROS writes them: whole seconds since 1970, and the rest beside them."""
    stamps = 1_700_000_000_990_000_000 + np.round(ROWS * 1e9).astype(np.int64)
    rows = [[t // 10**9, t % 10**9, *q, *q] for t, q in zip(stamps.tolist(), WAYS, strict=True)]
    text = "\n".join(["secs,nsecs,q1,q2,u1,u2", *(",".join(map(str, row)) for row in rows)])
    (rollout,) = written(tmp_path, text + "\n", SMALL_MAP + "time: [secs, nsecs]\n")
    np.testing.assert_allclose(rollout.time - rollout.time[0], ROWS, atol=1e-9)


def test_a_third_column_of_time_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"time.*seconds and nanoseconds"):
        written(tmp_path, lines(), SMALL_MAP + "time: [a, b, c]\n")
