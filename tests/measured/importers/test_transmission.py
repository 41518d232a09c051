"""Logs of motors that turn with several joints: positions and torques of the joints, and maps that cannot say them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.importers import import_dataset
from bumblebee.measured.rollout import read_dataset

COLUMNS = """joints: [shoulder, pitch, roll]
angle_unit: [rad, deg, deg]
columns: {joint_pos: [m0, m1, m2], joint_vel: [v0, v1, v2], joint_torque_cmd: [t0, t1, t2]}
"""
DIFFERENTIAL = "transmission: {pitch: {pitch: 0.5, roll: 0.5}, roll: {pitch: 0.5, roll: -0.5}}\n"
BEVEL = "transmission: {roll: {roll: 1, pitch: -0.8}}\n"
MATRICES = {DIFFERENTIAL: [[0.5, 0.5], [0.5, -0.5]], BEVEL: [[1.0, 0.0], [-0.8, 1.0]]}


def imported(folder: Path, text: str) -> None:
    (folder / "map.yaml").write_text(text)
    import_dataset(folder / "log.csv", "csv", folder / "set", None, folder / "map.yaml")


@pytest.fixture
def log(tmp_path: Path) -> dict[str, np.ndarray]:
    """A log of three motors, its wrist's in degrees."""
    time, rng = np.arange(200) / 100, np.random.default_rng(3)
    phase = rng.uniform(0, 6, 3)
    moved = {
        "m": 0.5 * np.sin(3 * time[:, None] + phase),
        "v": 1.5 * np.cos(3 * time[:, None] + phase),
        "t": 2.0 * np.sin(5 * time[:, None] + phase),
    }
    turned = {name: np.degrees(values) if name != "t" else values for name, values in moved.items()}
    table = {f"{name}{k}": (turned if k else moved)[name][:, k] for name in moved for k in range(3)}
    pd.DataFrame({"time": time, **table}).to_csv(tmp_path / "log.csv", index=False)
    return moved


@pytest.mark.parametrize("said", MATRICES)
def test_joints_follow_from_motors_and_the_power_stays(tmp_path: Path, log: dict[str, np.ndarray], said: str) -> None:
    imported(tmp_path, COLUMNS + said)
    rollout = read_dataset(tmp_path / "set").rollouts[0]
    matrix = np.array(MATRICES[said])
    np.testing.assert_allclose(rollout.joint_pos[:, 1:], log["m"][:, 1:] @ matrix.T, atol=1e-9)
    np.testing.assert_allclose(rollout.joint_vel[:, 1:], log["v"][:, 1:] @ matrix.T, atol=1e-9)
    assert rollout.joint_torque_cmd is not None
    np.testing.assert_allclose(
        (rollout.joint_torque_cmd * rollout.joint_vel).sum(axis=1), (log["t"] * log["v"]).sum(axis=1), atol=1e-9
    )
    np.testing.assert_allclose(rollout.joint_torque_cmd[:, 0], log["t"][:, 0])


@pytest.mark.parametrize(
    ("said", "names"),
    [
        ("transmission: [1, 2]\n", "joint -> "),
        ("transmission: {pitch: 0.5}\n", "joint -> "),
        ("transmission: {yaw: {pitch: 1}}\n", "'yaw'"),
        ("transmission: {pitch: {tilt: 1}}\n", "'tilt'"),
        ("transmission: {pitch: {roll: .nan}}\n", "a number"),
        ("transmission: {pitch: {roll: true}}\n", "a number"),
        ("transmission: {pitch: {pitch: 1, roll: 1}, roll: {pitch: 2, roll: 2}}\n", "singular"),
        ("transmission: {pitch: {roll: 1}}\n", "singular"),
        (f"{DIFFERENTIAL}meta: {{kp: [40, 40, 40]}}\n", "declare the joints' gains"),
    ],
)
def test_a_transmission_that_cannot_be_is_refused(tmp_path: Path, log: object, said: str, names: str) -> None:
    with pytest.raises(BadInput, match=names):
        imported(tmp_path, COLUMNS + said)
    assert not (tmp_path / "set").exists()
