"""Importer of SO-101 recordings (SAGE layout): a folder a motion with control.csv, state_motor.csv, joint_list.txt.

Traps of the layout: time stamps are microseconds; the Jaw is a share of its travel, not radians; torques are unsigned
current estimates and are left out.
"""

import contextlib
import json
import re
from pathlib import Path, PurePosixPath

import numpy as np
import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.measured.importers.source import NO_VELOCITY, Source, differences, measured_rate, open_source
from bumblebee.measured.rollout import Rollout
from bumblebee.measured.tables import read_csv

JAW_ZERO, JAW_TRAVEL = -0.174533, 2.336  # rad at share 0, rad from share 0 to 1
NOTES = (
    "SO-101, SAGE layout. Jaw scaled from its share of travel to rad (-0.174533 + 2.336 share). joint_torque left out: "
    "the logged torques are unsigned current estimates. Joints are read one after another, some milliseconds after the "
    "row's time; joint_vel has steps of 0.0767 rad/s."
)


def import_so101(place: Path) -> list[Rollout]:
    """Every motion of a folder or zip archive of SO-101 recordings."""
    source = open_source(place)
    folders = [PurePosixPath(name).parent for name in source.ending("control.csv")]
    if not folders:
        raise BadInput(place, "motion folders with control.csv and state_motor.csv", "none")
    return [_read_motion(source, folder) for folder in folders]


def _read_motion(source: Source, folder: PurePosixPath) -> Rollout:
    for name in ("state_motor.csv", "joint_list.txt"):
        if str(folder / name) not in source.names:
            raise BadInput(f"{source.place}/{folder}", f"{name} beside control.csv", "no such file")
    listed = source.read_text(str(folder / "joint_list.txt"))
    joints = tuple(re.findall(r"[^\s,\[\]\"']+", listed))
    if not joints or len(set(joints)) < len(joints):
        came = ", ".join(joints)[:80] or "none"
        raise BadInput(f"{source.place}/{folder}/joint_list.txt", "names of joints, each once", came)
    stamps, commands = _read_table(source, str(folder / "control.csv"), ("positions",), len(joints))
    state = str(folder / "state_motor.csv")
    fast = "velocities" in source.read(state).split(b"\n", 1)[0].decode("utf-8", "replace")
    times, states = _read_table(source, state, ("positions", "velocities") if fast else ("positions",), len(joints))
    if len(stamps) != len(times) or not np.array_equal(stamps, times):
        came = f"{len(stamps)} and {len(times)} rows with other time stamps"
        raise BadInput(f"{source.place}/{folder}", "control.csv and state_motor.csv row by row", came)
    for table in (commands, states):
        if "Jaw" in joints:
            jaw = joints.index("Jaw")
            table["positions"][:, jaw] = JAW_ZERO + JAW_TRAVEL * table["positions"][:, jaw]
    time = times * 1e-6
    meta = {"robot": "so101", "motion": folder.name, "notes": NOTES if fast else f"{NOTES} {NO_VELOCITY}."}
    return Rollout(
        folder.name or source.place.stem,
        joints,
        measured_rate(time),
        time,
        states["positions"],
        states["velocities"] if fast else differences(time, states["positions"]),
        joint_target=commands["positions"],
        meta=meta,
    )


def _read_table(
    source: Source, name: str, columns: tuple[str, ...], width: int
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Time stamps [us] and vector columns of one CSV whose vectors are JSON lists in quotes."""
    where = source.where(name)
    table = read_csv(where, source.read(name), source.limits)
    for column in ("timestamp", *columns):
        if column not in table.columns:
            raise BadInput(
                f"{where}: column {column}", "this column", f"only {', '.join(map(str, table.columns[:40]))}"
            )
    vectors = {}
    for column in columns:
        vectors[column] = _vectors(f"{where}: column {column}", table[column].astype(str).tolist(), width)
    stamps = table["timestamp"]
    if stamps.dtype.kind not in "iuf":
        row = int(np.argmax(pd.to_numeric(stamps.astype(str), errors="coerce").isna()))
        raise BadInput(f"{where}: column timestamp, row {row}", "microseconds", repr(stamps.iloc[row])[:60])
    return stamps.to_numpy(dtype=np.float64, na_value=np.nan), vectors


def _vectors(where: str, texts: list[str], width: int) -> np.ndarray:
    """(rows, width) from JSON lists, parsed at once; only where that fails row by row, to name the row."""
    with contextlib.suppress(ValueError, TypeError, RecursionError, OverflowError):
        values = np.array(json.loads(f"[{','.join(texts)}]"), dtype=np.float64)
        if values.shape == (len(texts), width):
            return values
    for row, text in enumerate(texts):
        try:
            row_values = [float(value) for value in json.loads(text)]
        except (ValueError, TypeError, RecursionError, OverflowError):
            raise BadInput(f"{where}, row {row}", f"a JSON list of {width} numbers", repr(text)[:60]) from None
        if len(row_values) != width:
            raise BadInput(f"{where}, row {row}", f"{width} values", str(len(row_values)))
    raise BadInput(where, f"JSON lists of {width} numbers", "lists that do not fit together")
