"""A corpus of bad logs, column maps and models: each is one clear line from `import`, and never a traceback."""

import io
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.measured.importers import import_dataset
from bumblebee.measured.importers.asap_npz import import_asap
from bumblebee.measured.rollout import read_rollout
from bumblebee.measured.tables import read_parquet
from tests.measured.arm_file import model_file
from tests.measured.simulated import g1_model, g1_rollout
from tests.measured.test_importers import asap_file

T = np.arange(30) * 0.02
Q = np.stack([np.sin(T), np.cos(T), T], axis=1)
MAP = "joints: [a, b]\ncolumns: {joint_pos: [q1, q2], joint_target: [u1, u2]}\n"
CSV = "time,q1,q2,u1,u2\n" + "".join(f"{t},{t},{t},{t},{t}\n" for t in T)


def refused(folder: Path, source: Path, kind: str, **more: Path) -> str:
    """The one line of a refused import, which leaves nothing behind."""
    before = sorted(folder.rglob("*"))
    with pytest.raises(BadInput) as caught:
        import_dataset(source, kind, folder / "out", **more)
    assert sorted(folder.rglob("*")) == before
    line = str(caught.value)
    assert "\n" not in line and "expected" in line and len(line) < 1500
    return line


def npz(**changes: object) -> dict[str, np.ndarray]:
    """The arrays of an ASAP log of the arm with some replaced; None takes one away."""
    arrays: dict[str, object] = {"time": T, "joint_pos": Q, "joint_vel": Q, "joint_pos_cmd": Q}
    arrays |= {"kp": np.full(3, 40.0), "kd": np.full(3, 2.0)} | changes
    return {key: np.asarray(value) for key, value in arrays.items() if value is not None}


def spoilt(values: np.ndarray, value: float) -> np.ndarray:
    values = values.copy()
    values.flat[7] = value
    return values


ASAP = {
    "empty kp": npz(kp=np.zeros(0)),
    "empty kp rows": npz(kp=np.zeros((0, 3))),
    "kp of others": npz(kp=np.ones(5)),
    "text kp": npz(kp=np.array(["a", "b", "c"])),
    "no command": npz(joint_pos_cmd=None),
    "shorter time": npz(time=T[:-1]),
    "longer time": npz(time=np.arange(99.0)),
    "no rows": npz(time=T[:0], joint_pos=Q[:0], joint_vel=Q[:0], joint_pos_cmd=Q[:0]),
    "scalar time": npz(time=1.0),
    "text time": npz(time=np.array([str(t) for t in T])),
    "date time": npz(time=T.astype("datetime64[s]")),
    "complex positions": npz(joint_pos=Q + 1j),
    "complex gains": npz(kd=np.ones(3) * 1j),
    "nan position": npz(joint_pos=spoilt(Q, np.nan)),
    "nan command": npz(joint_pos_cmd=spoilt(Q, np.nan)),
    "nan time": npz(time=spoilt(T, np.nan)),
    "infinite velocity": npz(joint_vel=spoilt(Q, np.inf)),
    "flat positions": npz(joint_pos=Q[:, 0]),
    "four axes": npz(joint_pos=Q[:, None, None]),
    "other joints": npz(joint_pos=Q[:, :2], joint_vel=Q[:, :2], joint_pos_cmd=Q[:, :2]),
    "one joint less": npz(joint_vel=Q[:, :2]),
    "quaternions of three": npz(IMU_quaternion=Q),
    "quaternion rows": npz(IMU_quaternion=np.ones((5, 4))),
    "a row for a gyro": npz(IMU_gyro=np.ones(3)),
    "velocity rows": npz(pos=Q, quat=np.ones((30, 4)), lin_vel=Q[:4]),
    "nan quaternion": npz(IMU_quaternion=np.full((30, 4), np.nan)),
}


@pytest.mark.parametrize("name", ASAP)
def test_a_bad_asap_log_is_one_line(tmp_path: Path, name: str) -> None:
    np.savez(tmp_path / "log.npz", **ASAP[name])
    assert "log.npz" in refused(tmp_path, tmp_path / "log.npz", "asap", model_path=model_file(tmp_path))


def test_the_asap_log_that_the_others_spoil_is_taken(tmp_path: Path) -> None:
    np.savez(tmp_path / "log.npz", **npz())
    assert import_dataset(tmp_path / "log.npz", "asap", tmp_path / "out", model_file(tmp_path)) == ["log"]


def test_xyzw_quaternions_in_an_asap_log_are_refused(tmp_path: Path) -> None:
    rollout = g1_rollout(0, 0.5, heading=1.5)
    wrong = replace(rollout, base_quat=np.roll(rollout.base_quat, -1, axis=1))
    asap_file(tmp_path / "log.npz", wrong, rollout.base_lin_vel)
    with pytest.raises(BadInput, match=r"IMU_quaternion.*wxyz.*xyzw"):
        import_asap(tmp_path / "log.npz", g1_model())


def header(shape: str) -> bytes:
    """An .npy file whose header claims more than there is."""
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode() + bytes(8)


def archive(**files: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as out:
        for name, data in files.items():
            out.writestr(name, data)
    return stream.getvalue()


BYTES = {
    "claims 745 GiB": archive(**{"time.npy": header("(100000000000,)")}),
    "claims a negative size": archive(**{"time.npy": header("(-5,)")}),
    "claims many axes": archive(**{"time.npy": header("(" + "1," * 99 + ")")}),
    "no header": archive(**{"time.npy": b"\x93NUMPY"}),
    "no array": archive(**{"time.npy": b"text"}),
    "bomb": archive(**{"time.npy": bytes(70 << 20)}),
    "nothing": b"",
    "no archive": b"PK\x03\x04" + bytes(40),
    "an array alone": header("(1,)"),
}


@pytest.mark.parametrize("kind", ["asap", "sysid"])
@pytest.mark.parametrize("name", BYTES)
def test_a_bad_npz_is_one_line_and_no_header_is_believed(tmp_path: Path, name: str, kind: str) -> None:
    (tmp_path / "log.npz").write_bytes(BYTES[name])
    refused(tmp_path, tmp_path / "log.npz", kind, model_path=model_file(tmp_path))


MAPS = {
    "numbers for joints": "joints: 5\ncolumns: {joint_pos: [q1, q2]}",
    "lists for joints": "joints: [[a], [b]]\ncolumns: {joint_pos: [q1, q2]}",
    "nothing for joints": "joints:\ncolumns: {joint_pos: [q1, q2]}",
    "numbers for columns": "joints: [a, b]\ncolumns: 3",
    "a number as key": "joints: [a, b]\ncolumns: {1: q1, joint_pos: [q1, q2]}",
    "a number for names": "joints: [a, b]\ncolumns: {joint_pos: 4}",
    "lists in names": "joints: [a, b]\ncolumns: {joint_pos: [[q1], [q2]]}",
    "a list for episode": MAP + "episode: [a, b]",
    "a list as unit": MAP + "time_unit: [s]",
    "no name for time": MAP + "time: []",
    "an infinite scale": MAP + "scale: {joint_pos: .inf}",
    "no number for scale": MAP + "scale: {joint_pos: .nan}",
    "a scale of nothing": MAP + "scale: {joint_pos: 0}",
    "text for scale": MAP + "scale: {joint_pos: 1+2j}",
    "an infinite offset": MAP + "offset: {joint_pos: [0, -.inf]}",
    "a list for scale": MAP + "scale: [1, 2]",
    "gains of others": MAP + "meta: {kp: [1, 2, 3]}",
    "text for gains": MAP + "meta: {kp: [a, b]}",
    "numbers for meta keys": MAP + "meta: {1: 2}",
    "code": "!!python/object/apply:os.system ['true']",
    "deep": "joints: " + "[" * 5000,
    "bombed": "a: &a [x,x,x,x,x,x,x,x,x,x]\n"
    + "".join(f"{chr(98 + i)}: &{chr(98 + i)} [{','.join([f'*{chr(97 + i)}'] * 10)}]\n" for i in range(8)),
    "columns in another order": "joints: [hip, knee]\ncolumns: {joint_pos: [q_knee, q_hip]}",
}


@pytest.mark.parametrize("name", MAPS)
def test_a_bad_column_map_is_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "log.csv").write_text(CSV.replace("q1,q2", "q_hip,q_knee") if "order" in name else CSV)
    (tmp_path / "map.yaml").write_text(MAPS[name])
    refused(tmp_path, tmp_path / "log.csv", "csv", column_map=tmp_path / "map.yaml")


def test_a_map_that_is_no_text_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(CSV)
    for content in (b"\xff\xfe\x00", b""):
        (tmp_path / "map.yaml").write_bytes(content)
        refused(tmp_path, tmp_path / "log.csv", "csv", column_map=tmp_path / "map.yaml")


TABLES = {
    "binary": bytes(range(256)) * 20,
    "empty": b"",
    "header alone": b"time,q1,q2,u1,u2\n",
    "text as time": CSV.replace("0.02,", "soon,", 1).encode(),
    "complex numbers": CSV.replace("0.02,", "0.02+1j,", 1).encode(),
    "columns twice": CSV.replace("u1,u2", "q1,q2", 1).encode(),
    "a column too few": CSV.replace(",u2", "", 1).encode(),
    "ragged": (CSV + "1,2,3,4,5,6,7,8,9\n").encode(),
    "an open quote": (CSV + '"1,2,3\n').encode(),
    "other bytes": CSV.encode("utf-16"),
    "many columns": b",".join(b"c%d" % i for i in range(30000)) + b"\n",
}


@pytest.mark.parametrize("name", TABLES)
def test_a_bad_csv_is_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "log.csv").write_bytes(TABLES[name])
    (tmp_path / "map.yaml").write_text(MAP)
    refused(tmp_path, tmp_path / "log.csv", "csv", column_map=tmp_path / "map.yaml")


@pytest.mark.parametrize("limits", [Limits(rows=9_999), Limits(unpacked_bytes=79_999)])
def test_a_parquet_file_is_measured_before_it_is_unpacked(tmp_path: Path, limits: Limits) -> None:
    """A column of equal values is a few bytes, however long it is."""
    pq.write_table(pa.table({"time": np.zeros(10_000)}), tmp_path / "log.parquet")
    content = (tmp_path / "log.parquet").read_bytes()
    assert len(content) < 2000 and len(read_parquet("x", content, ["time"])) == 10_000
    with pytest.raises(BadInput, match=r"at most"):
        read_parquet("x", content, ["time"], limits)


def test_an_archive_that_unpacks_too_far_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "logs.zip").write_bytes(archive(**{"a.csv": b"time,q1\n" + b"0,0\n" * (20 << 20)}))
    assert (tmp_path / "logs.zip").stat().st_size < 1 << 20
    (tmp_path / "map.yaml").write_text(MAP)
    refused(tmp_path, tmp_path / "logs.zip", "csv", column_map=tmp_path / "map.yaml")


MODELS = {
    "binary": bytes(range(256)),
    "empty": b"",
    "no model": b"<html/>",
    "cut off": b"<mujoco><worldbody>",
    "includes itself": b'<mujoco><include file="arm.xml"/></mujoco>',
    "includes what is not there": b'<mujoco><include file="none.xml"/></mujoco>',
    "a billion bodies": b'<mujoco><worldbody><replicate count="1000000000"><geom size="1"/></replicate>',
    "a huge texture": b'<mujoco><asset><texture type="2d" builtin="flat" width="99999" height="99999"/>',
    "memory": b'<mujoco><size memory="999G"/></mujoco>',
}  # fmt: skip


@pytest.mark.parametrize("name", MODELS)
def test_a_bad_model_is_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "arm.xml").write_bytes(MODELS[name])
    np.savez(tmp_path / "log.npz", **npz())
    assert "arm.xml" in refused(tmp_path, tmp_path / "log.npz", "asap", model_path=tmp_path / "arm.xml")


def test_a_folder_for_a_model_a_file_above_the_output_and_a_taken_name_are_one_line(tmp_path: Path) -> None:
    np.savez(tmp_path / "log.npz", **npz())
    arm = model_file(tmp_path)
    refused(tmp_path, tmp_path / "log.npz", "asap", model_path=tmp_path)
    for out in (tmp_path / "log.npz" / "out", arm, tmp_path):
        with pytest.raises(BadInput):
            import_dataset(tmp_path / "log.npz", "asap", out, arm)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.xml", "log.npz"]


def test_episodes_that_name_places_elsewhere_or_nothing_stay_inside_and_none_is_lost(tmp_path: Path) -> None:
    keys = ["/../../../x", "a/b", "a_b", "A_B", "", "none", "..", "\\c", "3", None]
    table = pd.DataFrame({name: np.tile(T[:5], len(keys)) for name in ("time", "q1", "q2", "u1", "u2")})
    table["run"] = [key for key in keys for _ in range(5)]
    home = tmp_path / "home"
    home.mkdir()
    table.to_parquet(home / "log.parquet")
    (home / "map.yaml").write_text(MAP + "episode: run\n")
    ids = import_dataset(home / "log.parquet", "csv", home / "set" / "out", column_map=home / "map.yaml")
    made = sorted(path.stem for path in (home / "set" / "out" / "rollouts").iterdir())
    assert len(ids) == len(keys) and sorted(ids) == made
    assert len({name.casefold() for name in ids}) == len(keys)
    assert {path.name for path in tmp_path.iterdir()} == {"home"}
    assert sum(read_rollout(home / "set/out/rollouts" / f"{name}.parquet").frames for name in ids) == len(table)
