"""The map from the contract's columns to a file's own names, as a YAML file says it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from bumblebee.measured.rollout import WIDTHS

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_LARGEST = 1e9  # of a factor or offset: from ticks of an encoder to rad is 1e-3, from nanometres 1e-9


@dataclass(frozen=True)
class ColumnMap:
    """Which columns of a CSV hold what; a file takes the first map of a list whose columns it has."""

    joints: tuple[str, ...]
    """Joints of the model, in the order in which the columns are named below."""
    columns: dict[str, tuple[str, ...]]
    """Column of the contract -> names in the file, one a joint or component; or one whose cells are lists of all.

    Without joint_vel velocities are differences of the positions.
    """
    time: tuple[str, ...] = ("time",)
    """Name of the column of time stamps; or of two, of whole seconds and of nanoseconds, as ROS stamps are."""
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    """Unit of the time stamps; of two columns the first is in s, the second in ns."""
    angle_unit: Literal["rad", "deg"] = "rad"
    """Unit of joint positions, velocities, targets and of the gyro."""
    quat_order: Literal["wxyz", "xyzw"] = "wxyz"
    """Order of base_quat as the file's columns are named in the map."""
    episode: str = ""
    """Column that numbers the episodes where a file holds several; each becomes a rollout."""
    valid: str = ""
    """Column that is 0 in rows that do not count, as `torque_enable` is once a servo was switched off."""
    scale: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Column of the contract -> factors, one a joint, on its values (in rad where they are angles)."""
    offset: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """The same, added after the factors."""
    meta: dict[str, Any] = field(default_factory=dict)
    """robot, kp, kd, notes and other metadata of the contract."""


def _pair(stem: str) -> tuple[str, ...]:
    return (f"{stem}1", f"{stem}2")


_PENDULUM = {"robot": "double_pendulum_A0"}
# The two layouts of dfki-ric-underactuated-lab/double_pendulum; the longer one first.
DOUBLE_PENDULUM = tuple(
    ColumnMap(("joint1", "joint2"), {column: _pair(stem) for column, stem in stems.items()}, meta=_PENDULUM)
    for stems in (
        {"joint_pos": "pos_meas", "joint_vel": "vel_meas", "joint_torque_cmd": "tau_con", "joint_torque": "tau_meas"},
        {"joint_pos": "pos", "joint_vel": "vel", "joint_torque_cmd": "tau"},
    )
)


def read_map(path: Path) -> ColumnMap:
    """A column map from a YAML file with the keys of `ColumnMap`."""
    table = read_yaml(Path(path))
    known = set(ColumnMap.__dataclass_fields__)
    if not isinstance(table, dict) or not {"joints", "columns"} <= set(table) or set(table) - known:
        came = ", ".join(map(str, table)) if isinstance(table, dict) else type(table).__name__
        raise BadInput(path, f"joints, columns and no keys but {', '.join(sorted(known))}", came[:200])
    units = {"time_unit": tuple(SECONDS), "angle_unit": ("rad", "deg"), "quat_order": ("wxyz", "xyzw")}
    for key, allowed in units.items():
        if table.get(key, allowed[0]) not in allowed:
            raise BadInput(f"{path}: {key}", f"one of {', '.join(allowed)}", repr(table[key])[:60])
    time = _names(f"{path}: time", table.get("time", "time"))
    if len(time) > 2:
        raise BadInput(f"{path}: time", "a column, or two: seconds and nanoseconds", ", ".join(time))
    joints = _names(f"{path}: joints", table["joints"])
    if len(set(joints)) < len(joints):
        raise BadInput(f"{path}: joints", "names of joints, each once", ", ".join(joints))
    columns = _columns(f"{path}: columns", table["columns"])
    for column, names in columns.items():
        _same_order(f"{path}: columns: {column}", joints, names)
    episode = _names(f"{path}: episode", table["episode"]) if table.get("episode") else ("",)
    if len(episode) > 1:
        raise BadInput(f"{path}: episode", "the name of one column", ", ".join(episode)[:60])
    valid = _names(f"{path}: valid", table["valid"]) if table.get("valid") else ("",)
    if len(valid) > 1:
        raise BadInput(f"{path}: valid", "the name of one column", ", ".join(valid)[:60])
    meta = table.get("meta", {})
    if not isinstance(meta, dict) or not all(isinstance(key, str) for key in meta):
        raise BadInput(f"{path}: meta", "keys and values", repr(meta)[:60])
    linear = {key: _linear(f"{path}: {key}", table.get(key), len(joints)) for key in ("scale", "offset")}
    if any(factor == 0 for factors in linear["scale"].values() for factor in factors):
        raise BadInput(f"{path}: scale", "factors other than 0", "0")
    given = {"joints": joints, "columns": columns, "time": time, "episode": episode[0], "meta": meta, "valid": valid[0]}
    return ColumnMap(**(table | given | linear))


def _columns(where: str, table: Any) -> dict[str, tuple[str, ...]]:
    """Column of the contract -> names in the file."""
    if not isinstance(table, dict):
        raise BadInput(where, "columns of the contract and names in the file", repr(table)[:60])
    wrong = [name for name in table if name not in WIDTHS]
    if wrong:
        raise BadInput(where, f"columns of the contract ({', '.join(WIDTHS)})", repr(wrong[0])[:60])
    if "joint_pos" not in table:
        raise BadInput(where, "joint_pos", f"only {', '.join(table) or 'nothing'}")
    return {column: _names(f"{where}: {column}", names) for column, names in table.items()}


def _names(where: str, value: Any) -> tuple[str, ...]:
    """A name or a list of names; whole numbers are names, too, since headers may be."""
    listed = value if isinstance(value, list) else [value]
    names = [str(one) if isinstance(one, int) and not isinstance(one, bool) else one for one in listed]
    if not names or not all(isinstance(one, str) and one.strip() for one in names) or isinstance(value, int):
        raise BadInput(where, "a name, or a list of names", repr(value)[:60])
    return tuple(names)


def _same_order(where: str, joints: Sequence[str], names: Sequence[str]) -> None:
    """Refuse names in the file that say another joint of the map than the one in whose place they stand."""
    if len(joints) != len(names):
        return
    for joint, name in zip(joints, names, strict=True):
        said = [other for other in joints if _says(name, other)]
        longest = max(said, key=len, default=joint)  # "left_knee" says "knee", too
        if longest != joint and not _says(name, joint):
            raise BadInput(where, f"the column of joint {joint}", name, f"It names {longest}: use one order for all.")


def _says(name: str, joint: str) -> bool:
    """Whether a column's name has a joint's name in it as a word of its own."""
    return bool(re.search(rf"(?<![0-9a-z]){re.escape(joint.lower())}(?![0-9a-z])", name.lower()))


def _linear(where: str, table: Any, width: int) -> dict[str, tuple[float, ...]]:
    """Column -> finite numbers, one a joint; a single number holds for all."""
    if table is None:
        return {}
    if not isinstance(table, Mapping):
        raise BadInput(where, "column -> one number, or one a joint", repr(table)[:60])
    out = {}
    for name, values in table.items():
        listed = values if isinstance(values, list) else [values]
        place = f"{where}: {name}"[:200]
        if WIDTHS.get(name) != "J" or len(listed) not in (1, width):
            raise BadInput(place, f"a joint column with 1 or {width} numbers", repr(values)[:60])
        if not all(isinstance(x, int | float) and not isinstance(x, bool) and abs(x) <= _LARGEST for x in listed):
            raise BadInput(place, f"finite numbers up to {_LARGEST:g}", repr(values)[:60])
        out[name] = tuple(float(x) for x in np.array(listed, dtype=np.float64))
    return out
