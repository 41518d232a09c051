"""One measured rollout as Parquet: what a robot's logger writes and what the diagnosis reads (contract, schema 1).

One row a control tick. Row k holds the state sampled at `time[k]` and the command issued at `time[k]`, held until
`time[k+1]`. Vectors are Arrow fixed-size lists; the metadata is one JSON object under the key `bumblebee.rollout`.
"""

import contextlib
import os
import shutil
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS, Limits
from bumblebee.measured.metadata import METADATA_KEY, Metadata, decode_metadata, encode_metadata
from bumblebee.measured.tables import arrow_table

# Column -> values a row; "J" is the number of joints. `foot_force` is (F, 3) and handled apart.
WIDTHS: dict[str, int | str] = {
    "joint_pos": "J",
    "joint_vel": "J",
    "joint_target": "J",
    "joint_torque_cmd": "J",
    "action": "J",
    "joint_torque": "J",
    "base_quat": 4,
    "base_ang_vel": 3,
    "base_lin_vel": 3,
    "base_pos": 3,
}
REQUIRED = ("time", "joint_pos", "joint_vel")
COMMANDS = ("joint_target", "joint_torque_cmd")
VECTORS = (*WIDTHS, "foot_force")
_IMPORT = "Logs of another layout become one: `bumblebee import --help`."


class BadRollout(BadInput):
    """A rollout that does not keep the contract; `column` and `rule` say where and which."""

    def __init__(self, file: object, column: str, rule: str, expected: str, came: str, do: str = "") -> None:
        self.file, self.column, self.rule = str(file), column, rule
        where = f"{file}: column {column}: rule {rule}" if column else f"{file}: rule {rule}"
        super().__init__(where, expected, came, do)

    def __reduce__(self) -> tuple[type["BadRollout"], tuple[str, ...]]:
        """Arguments that another process makes it from again."""
        return type(self), (self.file, self.column, self.rule, self.expected, self.came, self.do)


@dataclass(frozen=True, eq=False)
class Rollout:
    """One rollout of T ticks on a robot with J joints; arrays are float64, columns that were not logged are None."""

    rollout_id: str
    """Name of the file without its ending."""
    joints: tuple[str, ...]
    """Joint names in column order, each a joint of the model."""
    control_hz: float
    """Rate of the control loop [Hz]."""
    time: np.ndarray
    """(T,) [s], strictly increasing, any start."""
    joint_pos: np.ndarray
    """(T, J) [rad], [m] for slides, as the encoder reads them."""
    joint_vel: np.ndarray
    """(T, J) [rad/s], [m/s] for slides."""
    joint_target: np.ndarray | None = None
    """(T, J) [rad]: position target of the low-level PD loop; this or `joint_torque_cmd` is needed."""
    joint_torque_cmd: np.ndarray | None = None
    """(T, J) [N m]: commanded torque, where the drive takes torque."""
    action: np.ndarray | None = None
    """(T, J): raw policy output, before scale and offset."""
    joint_torque: np.ndarray | None = None
    """(T, J) [N m]: what the drive reports."""
    base_quat: np.ndarray | None = None
    """(T, 4) wxyz, world from base."""
    base_ang_vel: np.ndarray | None = None
    """(T, 3) [rad/s] in the base frame (gyro)."""
    base_lin_vel: np.ndarray | None = None
    """(T, 3) [m/s] in the base frame (odometry)."""
    base_pos: np.ndarray | None = None
    """(T, 3) [m] world."""
    foot_force: np.ndarray | None = None
    """(T, F, 3) [N] world."""
    meta: dict[str, Any] = field(default_factory=dict)
    """robot, kp, kd, conditions, motion, cluster, policy, recorded_at, operator, notes; each may be absent."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", tuple(self.joints))
        object.__setattr__(self, "control_hz", float(self.control_hz))
        for column in ("time", *VECTORS):
            values = getattr(self, column)
            if values is not None:
                object.__setattr__(self, column, np.asarray(values, dtype=np.float64))
        _check_shapes(self)

    @property
    def frames(self) -> int:
        """Number of control ticks T."""
        return len(self.time)

    @property
    def duration(self) -> float:
        """Seconds from the first to the last sample."""
        return float(self.time[-1] - self.time[0])

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the vector columns that are there."""
        return tuple(column for column in VECTORS if getattr(self, column) is not None)


@dataclass(frozen=True)
class Dataset:
    """A folder of rollouts and the declared model that lies beside them, if any."""

    rollouts: list[Rollout]
    model_path: Path | None


def write_rollout(path: Path, rollout: Rollout) -> None:
    """Write one rollout; the file appears whole or not at all, and one that exists is never overwritten."""
    path = Path(path)
    if path.exists():
        raise BadRollout(path, "", "never-overwritten", "a new file name", "a file that exists", "Write elsewhere.")
    content = _to_table(rollout)
    # What could not be read back, a name that leads elsewhere first of all, is not written.
    decode_metadata(path, content.schema.metadata[METADATA_KEY], BadRollout)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem[:40]}.", suffix=".part")
    os.close(handle)
    try:
        pq.write_table(content, temporary, compression="zstd")
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)


def read_rollout(path: Path, limits: Limits = LIMITS) -> Rollout:
    """Read one rollout of the contract; `BadRollout` names file, column and rule where it does not keep to it."""
    path = Path(path)
    table = _read_table(path, limits)
    meta = decode_metadata(path, (table.schema.metadata or {}).get(METADATA_KEY), BadRollout)
    _require_columns(path, table)
    joints = len(meta.joints)
    columns = {"time": _scalars(path, table)}
    for column in WIDTHS:
        if column in table.column_names:
            width = joints if WIDTHS[column] == "J" else int(WIDTHS[column])
            columns[column] = _vectors(path, table, column, width)
    if "foot_force" in table.column_names:
        columns["foot_force"] = _foot_force(path, table)
    try:
        return Rollout(meta.rollout_id, meta.joints, meta.control_hz, meta=meta.rest, **columns)
    except BadRollout as bad:
        raise BadRollout(path, bad.column, bad.rule, bad.expected, bad.came, bad.do) from None


def copy_of_cluster(source: Path, target: Path, cluster: str) -> None:
    """Copy a rollout that lies in the folder of a cluster, so that the copy names it; the original is left as it is.

    A file that names this cluster, or cannot be read, is copied to the byte: the intake says what is wrong with it. Of
    one that names none, the copy holds the contract's columns.

    Raises:
        BadInput: if it names another cluster.
    """
    try:
        rollout = read_rollout(source)
    except BadRollout:
        shutil.copy2(source, target)
        return
    named = rollout.meta.get("cluster") or ""
    if not named:
        write_rollout(target, replace(rollout, meta=rollout.meta | {"cluster": cluster}))
    elif named == cluster:
        shutil.copy2(source, target)
    else:
        where = f"{source}: metadata: cluster"
        raise BadInput(where, f"{cluster!r}, its folder's, or none", repr(named)[:80], "Move or correct the file.")


def rollout_files(folder: Path) -> list[Path]:
    """The rollout files of a dataset folder, sorted by name."""
    inner = Path(folder) / "rollouts"
    if not inner.is_dir():
        raise BadInput(folder, "a dataset folder that holds rollouts/*.parquet", "no folder rollouts in it", _IMPORT)
    return sorted(file for file in inner.glob("*.parquet") if not file.name.startswith("."))


def read_dataset(folder: Path) -> Dataset:
    """Read a whole dataset; the first file that does not keep the contract ends it with `BadRollout`."""
    files = rollout_files(folder)
    if not files:
        raise BadInput(Path(folder) / "rollouts", "at least one *.parquet", "none")
    model = Path(folder) / "model.xml"
    return Dataset([read_rollout(file) for file in files], model if model.is_file() else None)


def _to_table(rollout: Rollout) -> pa.Table:
    columns: dict[str, pa.Array] = {"time": pa.array(rollout.time)}
    for column in rollout.columns:
        values = getattr(rollout, column)
        array = pa.array(np.ascontiguousarray(values).reshape(-1))
        for width in reversed(values.shape[1:]):
            array = pa.FixedSizeListArray.from_arrays(array, width)
        columns[column] = array
    meta = Metadata(rollout.rollout_id, rollout.joints, rollout.control_hz, rollout.meta)
    return pa.table(columns).replace_schema_metadata({METADATA_KEY: encode_metadata(meta)})


def _read_table(path: Path, limits: Limits) -> pa.Table:
    """The contract's columns of a file; others are left alone."""
    if not path.is_file():
        raise BadRollout(path, "", "readable", "a Parquet file", "no such file")
    try:
        if path.stat().st_size > limits.file_bytes:
            raise BadInput(path, f"at most {limits.file_bytes:,} bytes", f"{path.stat().st_size:,}")
        with pa.OSFile(str(path)) as source:
            return arrow_table(path, source, ("time", *VECTORS), limits)
    except BadInput as bad:
        column = bad.where.removeprefix(str(path)).removeprefix(": column ")
        raise BadRollout(path, column, "unique-columns" if column else "readable", bad.expected, bad.came) from None
    except (OSError, ValueError) as error:
        raise BadRollout(path, "", "readable", "a file that can be read", str(error)) from None


def _require_columns(path: Path, table: pa.Table) -> None:
    for column in REQUIRED:
        if column not in table.column_names:
            raise BadRollout(
                path,
                column,
                "required-column",
                "this column",
                f"only {', '.join(table.column_names) or 'columns of others'}",
            )
    if not any(column in table.column_names for column in COMMANDS):
        raise BadRollout(path, "joint_target", "command-column", "joint_target or joint_torque_cmd", "neither of them")
    if table.num_rows < 2:
        raise BadRollout(path, "time", "length", "at least 2 rows", str(table.num_rows))


def _scalars(path: Path, table: pa.Table) -> np.ndarray:
    column = table.column("time")
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        raise BadRollout(path, "time", "column-type", "float64 seconds", str(column.type))
    return column.to_numpy().astype(np.float64)


def _vectors(path: Path, table: pa.Table, name: str, width: int) -> np.ndarray:
    """A list column as (T, width); a null value inside becomes NaN, a null row is an error."""
    flat = _flatten(path, table.column(name), name, width)
    if not (pa.types.is_floating(flat.type) or pa.types.is_integer(flat.type)):
        raise BadRollout(path, name, "column-type", "lists of float64", str(table.column(name).type))
    return flat.to_numpy(zero_copy_only=False).astype(np.float64).reshape(-1, width)


def _foot_force(path: Path, table: pa.Table) -> np.ndarray:
    column = table.column("foot_force").combine_chunks()
    rows = len(column)
    feet = column.type.list_size if pa.types.is_fixed_size_list(column.type) else 0
    inner = _flatten(path, column, "foot_force", feet)
    return _vectors(path, pa.table({"foot_force": inner}), "foot_force", 3).reshape(rows, feet, 3)


def _flatten(path: Path, column: pa.Array | pa.ChunkedArray, name: str, width: int) -> pa.Array:
    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if not pa.types.is_fixed_size_list(array.type):
        raise BadRollout(path, name, "column-type", f"an Arrow fixed-size list of {width or 'F'}", str(array.type))
    if array.type.list_size != width:
        raise BadRollout(path, name, "column-width", f"{width} values a row", str(array.type.list_size))
    if array.null_count:
        row = int(np.argmax(array.is_null().to_numpy(zero_copy_only=False)))
        raise BadRollout(path, name, "null", "a list in every row", f"null in row {row}")
    return array.flatten()


def _check_shapes(rollout: Rollout) -> None:
    """Shapes and the presence of a command; raises `BadRollout` that names the rollout in place of a file."""
    where, rows, joints = rollout.rollout_id, len(rollout.time), len(rollout.joints)
    if rollout.time.ndim != 1:
        raise BadRollout(where, "time", "column-width", "(T,)", str(rollout.time.shape))
    if all(getattr(rollout, column) is None for column in COMMANDS):
        raise BadRollout(where, "joint_target", "command-column", "joint_target or joint_torque_cmd", "neither of them")
    for column in rollout.columns:
        shape = getattr(rollout, column).shape
        width = WIDTHS.get(column)
        expected = (rows, joints) if width == "J" else (rows, width)
        if column == "foot_force" and (len(shape) == 3 and shape[0] == rows and shape[2] == 3):
            continue
        if shape != expected:
            raise BadRollout(where, column, "column-width", f"shape {expected}", str(shape))
