"""HDF5 files and LeRobot datasets give back the rollouts that were written; units and orders must be stated."""

from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.importers import import_dataset, read_rollouts
from bumblebee.measured.importers.extras import library
from bumblebee.measured.rollout import Rollout, read_dataset
from tests.measured.importers.recordings import HDF5_MAP, LEROBOT_MAP, write_hdf5, write_lerobot
from tests.measured.simulated import ARM_JOINTS, arm_rollout


def imported(folder: Path, name: str, kind: str, text: str) -> list[Rollout]:
    (folder / "map.yaml").write_text(text)
    return read_rollouts(folder / name, kind, column_map=folder / "map.yaml")


def same(ours: Rollout, theirs: Rollout, atol: float) -> None:
    assert ours.joints == ARM_JOINTS
    np.testing.assert_allclose(ours.time - ours.time[0], theirs.time - theirs.time[0], atol=1e-6)
    for column in ("joint_pos", "joint_target"):
        np.testing.assert_allclose(getattr(ours, column), getattr(theirs, column), atol=atol, err_msg=column)


def test_an_hdf5_file_in_degrees_and_milliseconds_is_the_rollout_again(tmp_path: Path) -> None:
    pytest.importorskip("h5py")
    write_hdf5(tmp_path / "log.h5", [arm_rollout(0)], episodes=False)
    (ours,) = imported(tmp_path, "log.h5", "hdf5", HDF5_MAP)
    same(ours, arm_rollout(0), 1e-12)
    np.testing.assert_allclose(ours.joint_vel, arm_rollout(0).joint_vel, atol=1e-12)


def test_groups_of_an_hdf5_file_are_episodes_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    pytest.importorskip("h5py")
    write_hdf5(tmp_path / "log.hdf5", [arm_rollout(k % 2, seconds=1.2) for k in range(11)], episodes=True)
    text = HDF5_MAP.replace("time: stamp\ntime_unit: ms", "hz: 50") + "episode: data/demo_*\n"
    found = imported(tmp_path, "log.hdf5", "hdf5", text)
    assert [one.rollout_id for one in found][-2:] == ["log_demo_9", "log_demo_10"]
    same(found[-1], arm_rollout(0, seconds=1.2), 1e-12)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (("angle_unit: deg\n", ""), "angle_unit.*nothing"),
        (("time_unit: ms\n", ""), "time_unit.*nothing"),
        (("obs/q,", "obs/qpos,"), "qpos.*only dq, q"),
        (("[shoulder, elbow, wrist]", "[shoulder, elbow]"), r"2 columns.*\(300, 3\)"),
        (("angle_unit: deg", "angle_unit: [deg, deg]"), "or 3 of them"),
        (("angle_unit: deg", "angle_unit: [deg, deg, rad]\nvalid: on"), "valid.*no such key"),
        (("deg\ncolumns: {", "turn\ncolumns: {base_ang_vel: gyro, "), "gyro_unit.*nothing"),
        (("angle_unit: deg", "angle_unit: normalised"), "scale.*factors of joint_pos to rad"),
    ],
)
def test_what_an_hdf5_map_leaves_open_is_one_line(tmp_path: Path, change: tuple[str, str], named: str) -> None:
    pytest.importorskip("h5py")
    write_hdf5(tmp_path / "log.h5", [arm_rollout(0)], episodes=False)
    assert change[0] in HDF5_MAP
    with pytest.raises(BadInput, match=named):
        imported(tmp_path, "log.h5", "hdf5", HDF5_MAP.replace(*change))


@pytest.mark.parametrize("way", ["external", "soft", "virtual", "raw", "huge", "text"])
def test_hdf5_that_points_elsewhere_or_claims_too_much_is_refused_unread(tmp_path: Path, way: str) -> None:
    h5py = pytest.importorskip("h5py")
    secret = tmp_path / "secret.h5"
    write_hdf5(secret, [arm_rollout(0)], episodes=False)
    write_hdf5(tmp_path / "log.h5", [arm_rollout(0)], episodes=False)
    with h5py.File(tmp_path / "log.h5", "r+") as file:
        del file["obs/q"]
        if way == "external":
            file["obs/q"] = h5py.ExternalLink(str(secret), "/obs/q")
        elif way == "soft":
            file["obs/q"] = h5py.SoftLink("/action")
        elif way == "virtual":
            layout = h5py.VirtualLayout((300, 3), dtype="f8")
            layout[:] = h5py.VirtualSource(str(secret), "/obs/q", (300, 3))
            file.create_virtual_dataset("obs/q", layout)
        elif way == "raw":
            file.create_dataset("obs/q", (300, 3), "f8", external=[(str(secret), 0, 7200)])
        elif way == "huge":
            file.create_dataset("obs/q", (10**12, 3), "f8", chunks=(1000, 3))
        else:
            file["obs/q"] = "a text"
    with pytest.raises(BadInput, match=r"elsewhere|at most|real numbers"):
        imported(tmp_path, "log.h5", "hdf5", HDF5_MAP)


@pytest.mark.parametrize("version", ["v3.0", "v2.1"])
def test_a_lerobot_dataset_in_degrees_is_the_rollouts_again(tmp_path: Path, version: str) -> None:
    rollouts = [arm_rollout(0), arm_rollout(1)]
    write_lerobot(tmp_path / "set", rollouts, ARM_JOINTS, np.pi / 180, version)
    found = imported(tmp_path, "set", "lerobot", LEROBOT_MAP)
    assert [one.rollout_id for one in found] == ["episode_0000", "episode_0001"]
    for ours, theirs in zip(found, rollouts, strict=True):
        same(ours, theirs, 1e-6)
        assert "not measured" in ours.meta["notes"] and ours.meta["robot"] == "arm" and ours.control_hz == 50


def test_normalised_joints_need_the_factors_to_rad(tmp_path: Path) -> None:
    write_lerobot(tmp_path / "set", [arm_rollout(0)], ARM_JOINTS, 0.02, "v3.0")
    text = LEROBOT_MAP.replace("deg", "normalised")
    with pytest.raises(BadInput, match=r"scale.*joint_pos.*calibration"):
        imported(tmp_path, "set", "lerobot", text)
    (ours,) = imported(tmp_path, "set", "lerobot", text + "scale: {joint_pos: 0.02, joint_target: 0.02}\n")
    same(ours, arm_rollout(0), 1e-6)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("joints: [shoulder, elbow, wrist, _]\n", "angle_unit.*nothing"),
        ("joints: [shoulder, elbow, wrist]\nangle_unit: deg\n", r"3 values.*shape \[4\].*gripper"),
        ("joints: [elbow, shoulder, wrist, _]\nangle_unit: deg\n", "column of joint elbow.*shoulder"),
        (LEROBOT_MAP + "columns: {joint_pos: state, joint_target: action}\n", "state, as the map says"),
    ],
)
def test_what_a_lerobot_map_leaves_open_is_one_line(tmp_path: Path, text: str, named: str) -> None:
    write_lerobot(tmp_path / "set", [arm_rollout(0)], ARM_JOINTS, 1.0, "v3.0")
    with pytest.raises(BadInput, match=named):
        imported(tmp_path, "set", "lerobot", text)


def test_an_imported_dataset_reads_like_any_other(tmp_path: Path) -> None:
    write_lerobot(tmp_path / "set", [arm_rollout(0)], ARM_JOINTS, 1.0, "v3.0")
    (tmp_path / "map.yaml").write_text(LEROBOT_MAP.replace("deg", "rad"))
    import_dataset(tmp_path / "set", "lerobot", tmp_path / "out", column_map=tmp_path / "map.yaml")
    (ours,) = read_dataset(tmp_path / "out").rollouts
    same(ours, arm_rollout(0), 1e-6)


def test_a_library_that_is_not_there_is_one_line_that_says_how_to_get_it() -> None:
    with pytest.raises(BadInput, match=r"pip install -e '\.\[logs\]'"):
        library("hdf5", "bumblebee_has_no_such_library")
