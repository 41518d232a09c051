"""The journal of a run: one record of fixed size for each tick of the guard, so that a kill costs the last ones alone.

A file begins with a line of JSON, which says what the run was, and goes on with records. A record that was not written
whole, and all after it, are left out when it is read.
"""

import json
import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.names import require_stem
from bumblebee.wire.links.lcm_codec import MAX_JOINTS
from bumblebee.wire.messages import State
from bumblebee.wire.safety.guard import Tick
from bumblebee.wire.safety.rules import RULES

_MARK, _SCHEMA = 0xB0B0_0001, 1
_SYNC = 0.5  # s between two times that the disk is waited for
_VECTORS = ("joint_pos", "joint_vel", "joint_torque", "wanted", "target", "torque", "kp", "kd", "action")
_PLACES = {"base_quat": 4, "base_ang_vel": 3, "base_lin_vel": 3, "base_pos": 3, "foot_force": 2}
STAGES = ("wake", "take", "think", "send")
"""Stages of a tick, each with its duration: late awake, messages in, decision, order out."""


@cache
def layout(joints: int) -> np.dtype:
    """Layout of a record for J joints; times are [ns], `robot_ns` and `heard_ns` by the robot's clock."""
    return np.dtype(
        [
            ("mark", "<u4"),
            ("sent_ns", "<i8"),
            ("order", "<i8"),
            ("state", "<i8"),
            ("came_ns", "<i8"),
            ("robot_ns", "<i8"),
            ("heard", "<i8"),
            ("heard_ns", "<i8"),
            ("phase", "u1"),
            ("step", "u1"),
            ("robot_mode", "u1"),
            ("rules", "<u4"),
            ("missed", "<u4"),
            ("asks", "<i4"),
            ("answers", "<i4"),
            ("asked_ns", "<i8"),
            ("took_ns", "<i8"),
            ("hottest", "<f4"),
            *((name, "<i8") for name in STAGES),
            *((name, "<f4", (joints,)) for name in _VECTORS),
            *((name, "<f4", (size,)) for name, size in _PLACES.items()),
            ("end", "<u4"),
        ]
    )


@dataclass(frozen=True)
class Entry:
    """One tick of the guard, as it is written down."""

    tick: Tick
    state: State | None
    """Newest usable one."""
    came_ns: int
    """When it came."""
    missed: int = 0
    """Ticks that were missed before this one."""
    stages: tuple[int, int, int, int] = (0, 0, 0, 0)
    """Durations of `STAGES` [ns]."""


def record(entry: Entry, joints: int) -> bytes:
    """Bytes of an entry."""
    row, tick, state, answer = np.zeros((), layout(joints)), entry.tick, entry.state, entry.tick.answer
    row["mark"] = row["end"] = _MARK
    row["sent_ns"], row["order"], row["phase"], row["step"] = (
        tick.order.stamp_ns,
        tick.order.sequence,
        tick.phase,
        tick.step,
    )
    row["rules"] = sum(1 << bit for bit, name in enumerate(RULES) if name in tick.rules)
    row["missed"], row["came_ns"] = entry.missed, entry.came_ns
    row["asks"] = -1 if tick.question is None else tick.question.tick
    row["answers"], row["asked_ns"] = (-1, -1) if answer is None else (answer.tick, answer.asked_ns)
    for name, value in zip(STAGES, entry.stages, strict=True):
        row[name] = value
    for name in ("target", "torque", "kp", "kd"):
        row[name] = getattr(tick.order, name)
    row["wanted"] = tick.wish.target
    row["state"] = row["heard"] = -1
    if answer is not None:
        row["action"], row["took_ns"] = answer.action, answer.took_ns
    if state is not None:
        for name in ("joint_pos", "joint_vel", "joint_torque", *_PLACES):
            row[name] = getattr(state, name)
        row["state"], row["robot_ns"], row["robot_mode"] = state.sequence, state.stamp_ns, state.mode
        row["heard"], row["heard_ns"], row["hottest"] = state.heard, state.heard_ns, state.temperature.max()
    return row.tobytes()


class Writer:
    """Appends records to a new file, and waits for the disk twice a second in a thread of its own.

    Args:
        path: of the new file.
        about: what its first line says.
    """

    def __init__(self, path: Path, about: Mapping[str, Any]) -> None:
        try:
            self._file = open(path, "xb", buffering=0)  # noqa: SIM115  # closed by `close`
        except FileExistsError:
            raise BadInput(path, "a new file", "one that exists", "Choose another --out.") from None
        self._file.write(json.dumps({"journal": _SCHEMA, **about}).encode() + b"\n")
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._sync, daemon=True)
        self._thread.start()

    def add(self, records: bytes) -> None:
        """Append one or several records."""
        self._file.write(records)

    def close(self) -> None:
        """Wait for the disk, and end."""
        self._ended.set()
        self._thread.join()
        os.fsync(self._file.fileno())
        self._file.close()

    def _sync(self) -> None:
        """Wait for the disk beside whoever writes: a slow disk must not stop the console's word to the guard."""
        while not self._ended.wait(_SYNC):
            os.fsync(self._file.fileno())


def read_journal(path: Path) -> tuple[dict[str, Any], np.ndarray]:
    """A journal's facts about its run, and its records.

    Raises:
        BadInput: no journal, or one of another version.
    """
    try:
        head, _, body = path.read_bytes().partition(b"\n")
        about = json.loads(head)
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(path, "a journal of `bumblebee deploy run`", type(error).__name__) from None
    if not isinstance(about, dict) or about.get("journal") != _SCHEMA:
        came = str(about.get("journal"))[:20] if isinstance(about, dict) else type(about).__name__
        raise BadInput(f"{path}: journal", str(_SCHEMA), came, "Read it with its own version.")
    _check_head(path, about)
    joints = len(about["joints"])
    size = layout(joints).itemsize
    rows = np.frombuffer(body[: len(body) // size * size], layout(joints))
    torn = np.flatnonzero((rows["mark"] != _MARK) | (rows["end"] != _MARK))
    return about, rows[: torn[0]] if len(torn) else rows


def _check_head(path: Path, about: dict[str, Any]) -> None:
    names, rate = about.get("joints"), about.get("control_hz")
    if not isinstance(names, list) or not 1 <= len(names) <= MAX_JOINTS or not all(isinstance(n, str) for n in names):
        raise BadInput(f"{path}: joints", f"1 to {MAX_JOINTS} names", repr(names)[:60])
    if isinstance(rate, bool) or not isinstance(rate, int | float) or not 1 <= rate <= 1000:
        raise BadInput(f"{path}: control_hz", "a number from 1 to 1000 Hz", repr(rate)[:60])
    require_stem(f"{path}: id", about.get("id"))
