"""Importers: what a layout says is what the contract's file says, in its units; damaged or hostile input is named."""

import json
import os
import zipfile
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mujoco import sysid

from bumblebee.errors import BadInput
from bumblebee.measured.checks import check_rollout
from bumblebee.measured.importers import import_dataset, read_rollouts
from bumblebee.measured.importers.source import open_source
from bumblebee.measured.rollout import Rollout, read_dataset
from bumblebee.quaternions import rotate_by_cross
from bumblebee.robot.facts import joint_names
from tests.measured.simulated import ARM, arm_model, arm_rollout, g1_model, g1_rollout

JOINTS = ("Rotation", "Jaw")


def so101_folder(folder: Path, rows: int = 40) -> np.ndarray:
    """A motion in the SO-101 layout; returns the raw values it holds, (rows, 2)."""
    folder.mkdir(parents=True)
    values = np.random.default_rng(0).uniform(0, 1, (rows, 2)).round(3)
    stamps = 7.1 + 20060.0 * np.arange(rows)
    head = {"control.csv": "type,timestamp,positions", "state_motor.csv": "type,timestamp,positions,velocities,torques"}
    for name, title in head.items():
        lists = [f'"{json.dumps(list(row))}"' for row in values]
        more = (lambda text: f",{text},{text}") if "state" in name else (lambda text: "")
        lines = [f"X,{stamp},{text}{more(text)}" for stamp, text in zip(stamps, lists, strict=True)]
        (folder / name).write_text("\n".join([title, *lines]) + "\n")
    (folder / "joint_list.txt").write_text("\n".join(JOINTS) + "\n")
    return values


def zipped(folder: Path, archive: Path) -> Path:
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as out:
        for path in sorted(folder.rglob("*")):
            out.write(path, path.relative_to(folder).as_posix())
    return archive


def test_so101_units_are_turned_into_the_contract_s(tmp_path: Path) -> None:
    values = so101_folder(tmp_path / "in" / "wave")
    (rollout,) = read_rollouts(tmp_path / "in", "so101")
    assert (rollout.rollout_id, rollout.joints) == ("wave", JOINTS)
    assert rollout.control_hz == 49.85
    np.testing.assert_allclose(np.diff(rollout.time), 0.02006, rtol=1e-9)
    np.testing.assert_allclose(rollout.joint_pos[:, 0], values[:, 0])
    np.testing.assert_allclose(rollout.joint_target[:, 1], -0.174533 + 2.336 * values[:, 1])
    np.testing.assert_allclose(rollout.joint_vel, values)  # velocities are rad/s for every joint
    assert rollout.joint_torque is None and "unsigned" in rollout.meta["notes"]


def test_an_archive_is_read_in_place_like_a_folder(tmp_path: Path) -> None:
    so101_folder(tmp_path / "in" / "a")
    so101_folder(tmp_path / "in" / "b")
    archive = zipped(tmp_path / "in", tmp_path / "motions.zip")
    before = sorted(tmp_path.rglob("*"))
    for ours, theirs in zip(read_rollouts(archive, "so101"), read_rollouts(tmp_path / "in", "so101"), strict=True):
        np.testing.assert_array_equal(ours.joint_pos, theirs.joint_pos)
        assert ours.rollout_id == theirs.rollout_id
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("name", ["../out.csv", "/etc/out.csv", "a/../../out.csv", "..\\out.csv", "C:\\out.csv"])
def test_an_archive_with_names_that_lead_out_is_refused(tmp_path: Path, name: str) -> None:
    with zipfile.ZipFile(tmp_path / "bad.zip", "w") as out:
        out.writestr(name, "x")
    with pytest.raises(BadInput, match="leads out"):
        open_source(tmp_path / "bad.zip")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda f: (f / "joint_list.txt").unlink(), "joint_list.txt"),
        (lambda f: (f / "joint_list.txt").write_text("One\n"), "1 values"),
        (lambda f: (f / "control.csv").write_text("type,timestamp\n"), "column positions"),
        (lambda f: (f / "control.csv").write_text((f / "control.csv").read_text().replace("[", "(")), "JSON list"),
        (lambda f: (f / "control.csv").write_text("\n".join((f / "control.csv").read_text().split("\n")[:9])), "rows"),
    ],
)
def test_a_damaged_so101_motion_is_named(tmp_path: Path, change: object, named: str) -> None:
    so101_folder(tmp_path / "wave")
    change(tmp_path / "wave")
    with pytest.raises(BadInput, match=named):
        read_rollouts(tmp_path, "so101")


def test_the_double_pendulum_s_two_layouts_are_told_apart_by_name(tmp_path: Path) -> None:
    short = "time,pos1,pos2,vel1,vel2,tau1,tau2"
    names = ("pos_meas", "vel_meas", "pos_filt", "vel_filt", "tau_con", "tau_fric", "tau_meas")
    long = ",".join(["time", *(f"{name}{i}" for name in names for i in (1, 2))])
    for name, head in (("short", short), ("long", long)):
        width = head.count(",")
        rows = [",".join(str(v) for v in (0.002 * k, *range(width))) for k in range(30)]
        (tmp_path / f"{name}.csv").write_text("\n".join([head, *rows]))
    long_one, short_one = read_rollouts(tmp_path, "double_pendulum")
    assert long_one.control_hz == short_one.control_hz == 500.0
    assert short_one.joint_torque_cmd[0].tolist() == [4, 5] and short_one.joint_torque is None
    assert long_one.joint_torque_cmd[0].tolist() == [8, 9] and long_one.joint_torque[0].tolist() == [12, 13]
    assert long_one.joint_vel[0].tolist() == [2, 3]


def test_a_column_map_names_columns_and_units(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text(
        "joints: [hip]\ntime: stamp\ntime_unit: ms\nangle_unit: deg\nquat_order: xyzw\nmeta: {robot: r}\n"
        "columns: {joint_pos: [q], joint_vel: [dq], joint_target: [cmd], base_quat: [x, y, z, w]}\n"
    )
    rows = "\n".join(f"{20 * k},90,180,45,0.1,0.2,0.3,0.9" for k in range(10))
    (tmp_path / "log.csv").write_text(f"stamp, q, dq, cmd, x, y, z, w\n{rows}\n")
    (rollout,) = read_rollouts(tmp_path / "log.csv", "csv", column_map=tmp_path / "map.yaml")
    assert rollout.control_hz == 50.0 and rollout.meta["robot"] == "r"
    np.testing.assert_allclose([rollout.joint_pos[0, 0], rollout.joint_vel[0, 0]], [np.pi / 2, np.pi])
    assert rollout.base_quat[0].tolist() == [0.9, 0.1, 0.2, 0.3]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("joints: [hip]\n", "columns"),
        ("joints: [hip]\ncolumns: {joint_poss: [q]}\n", "joint_poss"),
        ("joints: [hip]\ncolumns: {joint_pos: [q]}\ntime_unit: min\n", "time_unit"),
        ("joints: [hip]\ncolumns: {joint_pos: [q]}\nunknown: 1\n", "unknown"),
        ("joints: [hip\n", "YAML"),
        ("joints: [hip]\ncolumns: {joint_pos: [nothing]}\n", "nothing"),
    ],
)
def test_a_wrong_column_map_is_named(tmp_path: Path, text: str, named: str) -> None:
    (tmp_path / "map.yaml").write_text(text)
    (tmp_path / "log.csv").write_text("time,q\n0,1\n1,1\n")
    with pytest.raises(BadInput, match=named):
        read_rollouts(tmp_path / "log.csv", "csv", column_map=tmp_path / "map.yaml")


def test_text_in_a_number_column_is_named_with_its_row(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,pos1,pos2,vel1,vel2,tau1,tau2\n0,0,0,0,0,0,0\n1,oops,0,0,0,0,0\n")
    with pytest.raises(BadInput, match=r"column pos1, row 1.*oops"):
        read_rollouts(tmp_path, "double_pendulum")


def asap_file(path: Path, rollout: Rollout, lin_vel: np.ndarray, joints: int = 29) -> None:
    """A log as ASAP's logger writes it, 29 joints of which 23 are the model's."""
    wide = {name: np.zeros((rollout.frames, joints)) for name in ("joint_pos", "joint_vel", "joint_target")}
    keep = [i for i, name in enumerate(joint_names(every=True)) if name in rollout.joints]
    for name, values in wide.items():
        values[:, keep] = getattr(rollout, name)
    np.savez(
        path,
        time=rollout.time + 1.7e9,
        joint_pos=wide["joint_pos"],
        joint_vel=wide["joint_vel"],
        joint_pos_cmd=wide["joint_target"],
        tau_est=wide["joint_pos"],
        kp=np.tile(np.arange(29.0), (rollout.frames, 1)),
        kd=np.tile(np.arange(29.0), (rollout.frames, 1)),
        IMU_quaternion=rollout.base_quat,
        IMU_gyro=rollout.base_ang_vel,
        pos=rollout.base_pos,
        quat=rollout.base_quat,
        lin_vel=lin_vel,
    )


@pytest.mark.parametrize("frame", ["world", "base"])
def test_an_asap_log_comes_out_in_the_contract_s_frames_whatever_its_own(tmp_path: Path, frame: str) -> None:
    rollout = g1_rollout(0, 0.5, heading=1.5)
    given = rotate_by_cross(rollout.base_quat, rollout.base_lin_vel) if frame == "world" else rollout.base_lin_vel
    asap_file(tmp_path / "motion_0.npz", rollout, given)
    (back,) = read_rollouts(tmp_path, "asap", g1_model())
    assert back.joints == rollout.joints and frame in back.meta["notes"]
    np.testing.assert_allclose(back.base_lin_vel, rollout.base_lin_vel, atol=1e-9)
    np.testing.assert_allclose(back.joint_pos, rollout.joint_pos)
    assert back.meta["kp"][:3] == [0, 1, 2] and len(back.meta["kp"]) == 23
    assert {finding.rule for finding in check_rollout(back, g1_model())} == {"gains"}


def test_pickled_objects_in_an_archive_are_refused_not_run(tmp_path: Path) -> None:
    class Payload:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return os.mkdir, (str(tmp_path / "executed"),)

    np.savez(tmp_path / "motion.npz", time=np.array([Payload()], dtype=object))
    for kind in ("asap", "sysid"):
        with pytest.raises(BadInput, match="pickled objects"):
            read_rollouts(tmp_path / "motion.npz", kind, g1_model())
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize("size", [0, 30, 400])
def test_a_truncated_archive_is_named(tmp_path: Path, size: int) -> None:
    rollout = g1_rollout(0, 0.5, heading=1.5)
    asap_file(tmp_path / "whole.npz", rollout, rollout.base_lin_vel)
    (tmp_path / "cut.npz").write_bytes((tmp_path / "whole.npz").read_bytes()[:size])
    with pytest.raises(BadInput, match=r"cut\.npz"):
        read_rollouts(tmp_path / "cut.npz", "asap", g1_model())


def sensed_arm() -> mujoco.MjModel:
    """The arm with a position and a velocity sensor on every joint."""
    joints = arm_rollout(0).joints
    lines = "".join(f'<position name="{name}" joint="{name}" kp="40" kv="2"/>' for name in joints)
    sensors = "".join(f'<joint{k} name="{name}_{k}" joint="{name}"/>' for k in ("pos", "vel") for name in joints)
    text = ARM.replace("ACTUATORS", lines).replace("</mujoco>", f"<sensor>{sensors}</sensor></mujoco>")
    return mujoco.MjModel.from_xml_string(text)


def write_sysid(folder: Path, rollout: Rollout, model: mujoco.MjModel, layout: str) -> None:
    """Write files as mujoco.sysid itself does: a trajectory with states or with sensors, or two time series."""
    control = sysid.TimeSeries.from_control_names(rollout.time, rollout.joint_target, model, list(rollout.joints))
    both = np.concatenate([rollout.joint_pos, rollout.joint_vel], axis=1)
    kinds = {"pos": sysid.SignalType.MjStateQPos, "vel": sysid.SignalType.MjStateQVel}
    sensors = [f"{name}_{kind}" for kind in kinds for name in rollout.joints]
    measured = sysid.TimeSeries.from_names(rollout.time, both, model, sensors)
    if layout == "series":
        control.save_to_disk(folder / "run_control.npz")
        measured.save_to_disk(folder / "run_sensordata.npz")
        return
    names = [(name, kind) for kind in kinds.values() for name in rollout.joints]
    state = sysid.TimeSeries.from_names(rollout.time, both, model, names) if layout == "states" else None
    start = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    sysid.SystemTrajectory(model, control, measured, start, state).save_to_disk(folder / "run.npz")


@pytest.mark.parametrize("layout", ["states", "sensors", "series"])
def test_files_of_mujoco_sysid_are_read(tmp_path: Path, layout: str) -> None:
    rollout, model = arm_rollout(0), sensed_arm()
    write_sysid(tmp_path, rollout, model, layout)
    (back,) = read_rollouts(tmp_path, "sysid", model)
    assert (back.rollout_id, back.joints, back.control_hz) == ("run", rollout.joints, 50.0)
    for column in ("time", "joint_pos", "joint_vel", "joint_target"):
        np.testing.assert_array_equal(getattr(back, column), getattr(rollout, column))
    assert check_rollout(back, model) == []


def test_a_dataset_appears_whole_with_its_model_and_is_never_replaced(tmp_path: Path) -> None:
    so101_folder(tmp_path / "in" / "wave")
    (tmp_path / "nominal.xml").write_text("<mujoco/>")
    out = tmp_path / "sets" / "out"
    assert import_dataset(tmp_path / "in", "so101", out, tmp_path / "nominal.xml") == ["wave"]
    dataset = read_dataset(out)
    assert [rollout.rollout_id for rollout in dataset.rollouts] == ["wave"] and dataset.model_path == out / "model.xml"
    with pytest.raises(BadInput, match="new folder"):
        import_dataset(tmp_path / "in", "so101", out)
    (tmp_path / "in" / "wave" / "joint_list.txt").unlink()
    with pytest.raises(BadInput):
        import_dataset(tmp_path / "in", "so101", tmp_path / "sets" / "other")
    assert [path.name for path in (tmp_path / "sets").iterdir()] == ["out"]


@pytest.mark.parametrize("kind", ["csv", "asap", "sysid", "rosbag"])
def test_an_unknown_layout_or_a_missing_option_is_named(tmp_path: Path, kind: str) -> None:
    with pytest.raises(BadInput, match=kind):
        read_rollouts(tmp_path, kind)


def test_nothing_to_import_is_named(tmp_path: Path) -> None:
    for kind in ("so101", "double_pendulum", "asap", "sysid"):
        with pytest.raises(BadInput, match="none"):
            read_rollouts(tmp_path, kind, arm_model())
    with pytest.raises(BadInput, match="neither"):
        read_rollouts(tmp_path / "no", "so101")
