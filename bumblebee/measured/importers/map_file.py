"""The map of a log as a YAML file, checked: what it must state and does not is named, not guessed."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from bumblebee.measured.importers.column_map import (
    ANGLES,
    CLOCKS,
    LAYOUTS,
    LEFT_OUT,
    MOVES,
    NAMED,
    SECONDS,
    UNCOMMANDED,
    ColumnMap,
)
from bumblebee.measured.importers.transmission import read_transmission, refuse_gains
from bumblebee.measured.importers.unitree import UNITREE

_STATE = "It is not guessed: state it."
_LARGEST = 1e9  # of a factor or offset: from ticks of an encoder to rad is 1e-3, from nanometres 1e-9
_CHOICES = {
    "time_unit": tuple(SECONDS),
    "gyro_unit": ("rad", "deg"),
    "quat_order": ("wxyz", "xyzw"),
    "grid": ("states", "commands"),
    "episodes": ("whole", "split"),
    "rows": ("all", "complete"),
}
LEROBOT = {
    "columns": {"joint_pos": "observation.state", "joint_target": "action"},
    "time": "timestamp",
    "episode": "episode_index",
}
"""Columns of LeRobot's datasets, v2 and v3."""


def read_map(path: Path, kind: str = "csv") -> ColumnMap:
    """A column map from a YAML file with the keys of `ColumnMap`.

    Args:
        path: the file.
        kind: the layout of the logs. For csv, whose maps are older, what is not stated is rad, s and wxyz; for the
            others a map without its units and clock is refused.
    """
    table = read_yaml(Path(path))
    table = _with_layout(path, LEROBOT | table if kind == "lerobot" and isinstance(table, dict) else table, kind)
    _require_keys(path, table, kind)
    for key, allowed in _CHOICES.items():
        if table.get(key, allowed[0]) not in allowed:
            raise BadInput(f"{path}: {key}", f"one of {', '.join(allowed)}", repr(table[key])[:60])
    joints = _names(f"{path}: joints", table["joints"])
    kept = [joint for joint in joints if joint != LEFT_OUT]
    if len(set(kept)) < len(kept) or not kept:
        raise BadInput(f"{path}: joints", "names of joints, each once", ", ".join(joints)[:200])
    columns = _columns(f"{path}: columns", table["columns"], kind)
    for column, names in columns.items():
        same_order(f"{path}: columns: {column}", joints, names)
    given: dict[str, Any] = {"joints": joints, "columns": columns, "time": ("time",)}
    given |= {key: _one_name(path, table, key) for key in ("episode", "valid")}
    given |= _clock(path, table, kind) | {"hz": _rate(f"{path}: hz", table.get("hz", 0.0))}
    given["angle_unit"] = _angle_unit(f"{path}: angle_unit", table, len(joints))
    given["names"] = _renamed(f"{path}: names", table.get("names"), joints)
    given["locked"] = _names(f"{path}: locked", table["locked"]) if table.get("locked") else ()
    given["order"] = _orders(f"{path}: order", table.get("order"))
    given["transmission"] = read_transmission(f"{path}: transmission", table.get("transmission"), joints)
    given["meta"] = _meta(f"{path}: meta", table.get("meta", {}))
    given |= {key: _linear(f"{path}: {key}", table.get(key), len(joints)) for key in ("scale", "offset")}
    if any(factor == 0 for factors in given["scale"].values() for factor in factors):
        raise BadInput(f"{path}: scale", "factors other than 0", "0")
    choices = {key: table[key] for key in _CHOICES if key in table}
    choices["gyro_unit"] = table.get("gyro_unit") or ("deg" if given["angle_unit"] == ("deg",) else "rad")
    chosen = ColumnMap(**(given | choices))
    _require_scales(path, chosen)
    _require_components(path, chosen)
    refuse_gains(str(path), chosen)
    return chosen


def _require_components(path: Path, chosen: ColumnMap) -> None:
    """Refuse a component twice, and a quaternion's names that have w at the other end than its order says.

    Joints may share a column, as the fingers of a gripper do; axes may be exchanged.
    """
    for column, names in chosen.columns.items():
        if NAMED[column] != "J" and len(set(names)) < len(names):
            raise BadInput(f"{path}: columns: {column}", "each component once", ", ".join(names)[:200])
    names = chosen.columns.get("base_quat", ())
    differ = ["".join(signs).lower() for signs in zip(*names, strict=False) if len(set(signs)) > 1]
    order = "wxyz" if chosen.quat_order == "xyzw" else "xyzw"
    if len(differ) == 1 and set(differ[0]) == set(order) and differ[0].index("w") == order.index("w"):
        came = f"{chosen.quat_order} beside {', '.join(names)}"[:200]
        raise BadInput(f"{path}: quat_order", "the order in which the names stand", came, f"`quat_order: {order}`.")


def _with_layout(path: Path, table: Any, kind: str) -> Any:
    """The map with what its `layout` says of columns, units and orders; what the map itself says counts."""
    if not isinstance(table, dict) or "layout" not in table:
        return table
    if kind != "rosbag" or table["layout"] not in LAYOUTS:
        raise BadInput(f"{path}: layout", f"of a rosbag one of {', '.join(LAYOUTS)}", repr(table["layout"])[:60])
    own = {key: value for key, value in table.items() if key != "layout"}
    out = UNITREE | own
    if isinstance(own.get("columns"), dict):
        out["columns"] = UNITREE["columns"] | own["columns"]
    if "order" not in own:  # its joints are listed as its motors are numbered
        topics = {_topic(name) for name in out["columns"].values() if isinstance(name, str)}
        out["order"] = dict.fromkeys(sorted(topics), own.get("joints", []))
    return out


def _topic(name: str) -> str:
    return name.split(":", 1)[0]


def _require_keys(path: Path, table: Any, kind: str) -> None:
    """Refuse unknown keys, and a map that leaves open what only its author knows."""
    known = set(ColumnMap.__dataclass_fields__) - {"clock"} | {"layout"}
    if not isinstance(table, dict) or not {"joints", "columns"} <= set(table) or set(table) - known:
        came = ", ".join(map(str, table)) if isinstance(table, dict) else type(table).__name__
        raise BadInput(path, f"joints, columns and no keys but {', '.join(sorted(known))}", came[:200])
    columns = table["columns"] if isinstance(table["columns"], dict) else {}
    if "base_ang_vel" in columns and table.get("angle_unit", "rad") not in ("rad", "deg") and "gyro_unit" not in table:
        raise BadInput(f"{path}: gyro_unit", "rad or deg (a second)", "nothing", _STATE)
    if kind == "csv":
        return
    if table.get("valid") and kind != "lerobot":
        raise BadInput(
            f"{path}: valid",
            "no such key, which csv and lerobot have",
            repr(table["valid"])[:60],
            "`rows: complete` leaves out rows without a number.",
        )
    stated = {"angle_unit": f"the unit of the joints, one of {', '.join(ANGLES)}, for all or one a joint"}
    if kind == "rosbag":
        stated["time"] = "the stamp that counts, header or log"
    if kind == "hdf5" and "hz" not in table:
        stated |= {"time": "the path of the time stamps, or hz", "time_unit": f"one of {', '.join(SECONDS)}"}
    if "base_quat" in columns:
        stated["quat_order"] = "wxyz or xyzw"
    for key, what in stated.items():
        if key not in table:
            raise BadInput(f"{path}: {key}", what, "nothing", _STATE)


def _clock(path: Path, table: dict[str, Any], kind: str) -> dict[str, Any]:
    """Columns of time stamps; of a bag the clock of each topic."""
    said = table.get("time", "time")
    if kind != "rosbag":
        time = _names(f"{path}: time", said)
        if len(time) > 2:
            raise BadInput(f"{path}: time", "a column, or two: seconds and nanoseconds", ", ".join(time))
        return {"time": time}
    clock = said if isinstance(said, dict) else {"": said}
    for topic, which in clock.items():
        if which not in CLOCKS or not isinstance(topic, str):
            raise BadInput(f"{path}: time", f"one of {', '.join(CLOCKS)}, or topic -> one of them", repr(said)[:60])
    return {"clock": clock}


def _angle_unit(where: str, table: dict[str, Any], joints: int) -> tuple[str, ...]:
    if "angle_unit" not in table:
        return ()
    said = table["angle_unit"]
    units = tuple(said) if isinstance(said, list) else (said,)
    if len(units) not in (1, joints) or any(unit not in ANGLES for unit in units):
        do = "Say m, and factors of 0.001 under scale." if "mm" in units else ""
        raise BadInput(where, f"one of {', '.join(ANGLES)}, or {joints} of them", repr(said)[:80], do)
    return units


def _require_scales(path: Path, chosen: ColumnMap) -> None:
    """Require that normalised columns have factors to rad in the map."""
    if "normalised" not in chosen.angle_unit:
        return
    for column in MOVES:
        if column in chosen.columns and column not in chosen.scale:
            do = "The span of the joint's calibration [rad] over that of the values; offset has the angle at 0."
            raise BadInput(f"{path}: scale", f"factors of {column} to rad, as its unit is normalised", "none", do)


def _rate(where: str, value: Any) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not (value == 0 or 1e-2 < value < 1e5):
        raise BadInput(where, "a rate in Hz", repr(value)[:60])
    return float(value)


def _meta(where: str, meta: Any) -> dict[str, Any]:
    if not isinstance(meta, dict) or not all(isinstance(key, str) for key in meta):
        raise BadInput(where, "keys and values", repr(meta)[:60])
    return meta


def _renamed(where: str, said: Any, joints: tuple[str, ...]) -> tuple[str, ...]:
    """The messages' names of the joints, in the joints' order."""
    if not said:
        return ()
    names = _names(where, said)
    if len(names) != len(joints) or len(set(names)) < len(names):
        raise BadInput(where, f"{len(joints)} names, each once, in the order of joints", ", ".join(names)[:200])
    return names


def _orders(where: str, said: Any) -> dict[str, tuple[str, ...]]:
    if said is None:
        return {}
    if not isinstance(said, Mapping) or not all(isinstance(topic, str) for topic in said):
        raise BadInput(where, "topic -> joints in the order of its values", repr(said)[:60])
    return {topic: _names(f"{where}: {topic}"[:200], joints) for topic, joints in said.items()}


def _one_name(path: Path, table: dict[str, Any], key: str) -> str:
    names = _names(f"{path}: {key}", table[key]) if table.get(key) else ("",)
    if len(names) > 1:
        raise BadInput(f"{path}: {key}", "the name of one column", ", ".join(names)[:60])
    return names[0]


def _columns(where: str, table: Any, kind: str) -> dict[str, tuple[str, ...]]:
    """Column of the contract -> names in the file."""
    if not isinstance(table, dict):
        raise BadInput(where, "columns of the contract and names in the file", repr(table)[:60])
    wrong = [name for name in table if name not in NAMED]
    if wrong:
        do = f"It is a key beside `columns`: `{wrong[0]}: ...`." if wrong[0] in ColumnMap.__dataclass_fields__ else ""
        raise BadInput(where, f"columns of the contract ({', '.join(NAMED)})", repr(wrong[0])[:60], do)
    if "joint_pos" not in table:
        raise BadInput(where, "joint_pos", f"only {', '.join(table) or 'nothing'}")
    columns = {column: _names(f"{where}: {column}", names) for column, names in table.items()}
    for column, names in columns.items():
        allowed = kind == "csv" and column in UNCOMMANDED and set(names) != {LEFT_OUT}
        if LEFT_OUT in names and not allowed:
            do = f"In a CSV {LEFT_OUT} stands for the command of a joint without an actuator, beside those of others."
            raise BadInput(f"{where}: {column}", "names in the file", repr(LEFT_OUT), do)
    return columns


def _names(where: str, value: Any) -> tuple[str, ...]:
    """A name or a list of names; whole numbers are names, too, since headers may be."""
    listed = value if isinstance(value, list) else [value]
    names = [str(one) if isinstance(one, int) and not isinstance(one, bool) else one for one in listed]
    if not names or not all(isinstance(one, str) and one.strip() for one in names) or isinstance(value, int):
        raise BadInput(where, "a name, or a list of names", repr(value)[:60])
    return tuple(names)


def same_order(where: str, joints: Sequence[str], names: Sequence[str]) -> None:
    """Refuse names in the file that say another joint of the map than the one in whose place they stand."""
    if len(joints) != len(names):
        return
    for joint, name in zip(joints, names, strict=True):
        said = [other for other in joints if other != LEFT_OUT and _says(name, other)] if joint != LEFT_OUT else []
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
        if NAMED.get(name) != "J" or len(listed) not in (1, width):
            raise BadInput(place, f"a joint column with 1 or {width} numbers", repr(values)[:60])
        if not all(isinstance(x, int | float) and not isinstance(x, bool) and abs(x) <= _LARGEST for x in listed):
            raise BadInput(place, f"finite numbers up to {_LARGEST:g}", repr(values)[:60])
        out[name] = tuple(float(x) for x in np.array(listed, dtype=np.float64))
    return out
