"""SQLite files of rosbag2 (`.db3`, the default until ROS 2 Humble), read from memory; no statement of theirs runs."""

import contextlib
import sqlite3
from collections.abc import Container
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.measured.importers.ros.recording import LARGEST, Message, Recording, Topic, require_small
from bumblebee.measured.importers.ros.types import TYPES

_STEPS = 2_000_000_000  # of SQLite's machine: some minutes, which no plain table of a gigabyte needs
_EVERY = 10_000_000


def read_sqlite(where: str, content: bytes, wanted: Container[str], limits: Limits) -> Recording:
    """The wanted topics of a `.db3` file."""
    if content[:16] != b"SQLite format 3\0" or len(content) < 512:
        raise BadInput(where, "an SQLite file of rosbag2", f"{len(content):,} bytes that are none")
    content = content[:18] + b"\1\1" + content[20:]  # write-ahead mode, which a file in memory has not
    try:
        with contextlib.closing(sqlite3.connect(":memory:")) as base:
            base.deserialize(content)
            _guard(base)
            return _read(where, base, wanted, limits)
    except BadInput:
        raise
    except Exception as error:  # sqlite3.Error, UnicodeDecodeError, MemoryError, OverflowError
        raise BadInput(where, "an SQLite file of rosbag2", f"{type(error).__name__}: {error}"[:200]) from None


def _guard(base: sqlite3.Connection) -> None:
    """Only reading of tables, a bound on steps, no values that are larger than a message may be."""
    allowed = (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ)
    left = [_STEPS // _EVERY]

    def stop() -> bool:
        left[0] -= 1
        return left[0] < 0

    base.execute("PRAGMA trusted_schema = OFF")
    base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, 64 * LARGEST)  # camera images beside the joints' topics are skipped
    base.set_progress_handler(stop, _EVERY)
    base.set_authorizer(lambda action, *rest: sqlite3.SQLITE_OK if action in allowed else sqlite3.SQLITE_DENY)


def _read(where: str, base: sqlite3.Connection, wanted: Container[str], limits: Limits) -> Recording:
    tables = {name for kind, name in base.execute("SELECT type, name FROM sqlite_master") if kind == "table"}
    if not {"topics", "messages"} <= tables:
        raise BadInput(where, "the tables topics and messages of rosbag2", ", ".join(sorted(tables))[:200] or "none")
    definitions = _definitions(base) if "message_definitions" in tables else {}
    topics, numbers, others = {}, {}, {}
    for number, name, kind, form in base.execute("SELECT id, name, type, serialization_format FROM topics"):
        if name not in wanted:
            others[str(name)] = str(kind)
            continue
        text = definitions.get(kind) or TYPES.get(kind)
        if form != "cdr" or not text:
            came = f"{form}, type {kind}"[:120]
            expected = f"cdr and a definition of the type (in the bag, or one of {', '.join(TYPES)})"
            raise BadInput(
                f"{where}: {name}",
                expected,
                came,
                "Convert the bag to MCAP, which holds its definitions: ros2 bag convert.",
            )
        topics[name], numbers[number] = Topic(kind, text), name
    held = 0
    for number, name in numbers.items():
        rows = base.execute("SELECT rowid, timestamp, data FROM messages WHERE topic_id = ? ORDER BY rowid", (number,))
        for place, stamp, data in rows:
            _require_row(where, stamp, data)
            held += len(data)
            require_small(where, name, len(data), limits, held)
            topics[name].messages.append(Message(stamp, stamp, data, place))
    return Recording(topics, others)


def _definitions(base: sqlite3.Connection) -> dict[str, str]:
    """Type -> definition, as bags since ROS 2 Iron hold them."""
    rows = base.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    return {kind: text for kind, encoding, text in rows if encoding == "ros2msg" and isinstance(text, str)}


def _require_row(where: str, stamp: Any, data: Any) -> None:
    if not isinstance(stamp, int) or not isinstance(data, bytes):
        raise BadInput(
            f"{where}: messages", "a whole stamp and bytes", f"{type(stamp).__name__}, {type(data).__name__}"
        )
