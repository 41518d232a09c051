"""Remedies of ROS 2 recordings."""

import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from tests.measured.importers import recordings
from tests.measured.importers.recordings import header, joint_messages, stamps_ns, write_db3, write_mcap
from tests.measured.importers.remedies.walk import Case, Import, settings
from tests.measured.simulated import ARM_JOINTS, arm_rollout

KIND = "sensor_msgs/msg/JointState"
Messages = list[tuple[str, str, int, Any]]


def state(stamp: int, names: list[str], place: list[float], speed: list[float], effort: list[float]) -> Any:
    return SimpleNamespace(header=header(stamp), name=names, position=place, velocity=speed, effort=effort)


@cache
def plain(seconds: float = 3.0) -> Messages:
    """States with three names, and commands without."""
    return joint_messages(arm_rollout(0, seconds=seconds), ARM_JOINTS)


def with_other(names: list[str]) -> Messages:
    """Beside the driver's states those of a publisher that knows positions alone, all 0."""
    out = []
    for topic, kind, stamp, message in plain(1.2):
        out.append((topic, kind, stamp, message))
        if topic == "/joint_states":
            out.append((topic, kind, stamp + 4_000_000, state(stamp + 4_000_000, names, [0.0] * 3, [], [])))
    return out


def with_header(messages: Messages) -> Messages:
    """Commands as JointState, so that every message has a header."""
    return [
        (topic, KIND, stamp, m if topic != "/command" else state(stamp, list(ARM_JOINTS)[::-1], list(m.data), [], []))
        for topic, _, stamp, m in messages
    ]


def unstamped() -> Messages:
    return [(t, k, s, SimpleNamespace(**vars(m) | {"header": header(0)})) for t, k, s, m in with_header(plain(1.2))]


def set_back(messages: Messages) -> Messages:
    """The recorder's clock is set back by 1.4 s at half the recording, so that its halves overlap."""
    half = messages[len(messages) // 2][2]
    return [(t, k, stamp if stamp < half else stamp - 1_400_000_000, m) for t, k, stamp, m in messages]


def recording(
    messages: Callable[[], Messages], edit: Callable[[dict], Any] = lambda table: None
) -> Callable[[Import], None]:
    """A recording beside a map by the recorder's clock."""

    def bad(attempt: Import) -> None:
        made = messages()
        write_mcap(attempt.logs / "run.mcap", made)
        attempt.kind, attempt.map = (
            "rosbag",
            {
                "joints": list(ARM_JOINTS),
                "time": "log",
                "angle_unit": "rad",
                "order": {"/command": ["wrist", "elbow", "shoulder"]},
                "columns": {
                    "joint_pos": "/joint_states:position",
                    "joint_vel": "/joint_states:velocity",
                    "joint_target": "/command:data" if made[0][1] != KIND else "/command:position",
                },
            },
        )
        if made[0][1] == KIND:
            del attempt.map["order"]
        edit(attempt.map)

    return bad


def without(key: str) -> Callable[[dict], Any]:
    return lambda table: table.pop(key)


def putting(**keys: Any) -> Callable[[dict], Any]:
    return lambda table: (table["columns"] if set(keys) & {"joint_vel", "joint_torque"} else table).update(keys)


def packed(attempt: Import) -> None:
    import zstandard

    recording(plain)(attempt)
    place = attempt.logs / "run.mcap"
    place.with_name("run.mcap.zstd").write_bytes(zstandard.compress(place.read_bytes()))
    place.unlink()


def unpacked(attempt: Import, line: str) -> None:
    """By the command that is printed, where it is installed."""
    command = line.partition("Unpack it first: ")[2].split()
    place = attempt.logs / command[-1]
    if shutil.which(command[0]):
        subprocess.run([*command[:-1], place, "-o", place.with_suffix("")], check=True, capture_output=True)
    else:
        import zstandard

        place.with_suffix("").write_bytes(zstandard.ZstdDecompressor().decompress(place.read_bytes(), 1 << 24))


@contextmanager
def known() -> Iterator[None]:
    """While the recordings are written the strange type is known."""
    recordings.TYPES["my_msgs/msg/State"] = recordings.TYPES[KIND]
    yield
    del recordings.TYPES["my_msgs/msg/State"]


def strange_type(attempt: Import) -> None:
    """A bag in SQLite whose message type nobody knows; what ros2 bag convert makes of it holds the definition."""
    recording(plain)(attempt)
    (attempt.logs / "run.mcap").unlink()
    with known():
        write_db3(attempt.logs / "run.db3", strange())


def strange() -> Messages:
    return [(t, "my_msgs/msg/State" if t == "/joint_states" else k, stamp, m) for t, k, stamp, m in plain()]


def converted(attempt: Import, line: str) -> None:
    assert line.endswith("Convert the bag to MCAP, which holds its definitions: ros2 bag convert.")
    (attempt.logs / "run.db3").unlink()
    with known():
        write_mcap(attempt.logs / "run.mcap", strange())


def named(attempt: Import, line: str) -> None:
    assert "List under `names` what the messages call shoulder, elbow, wrist, in this order" in line
    attempt.map["names"] = ["j1", "j2", "j3"]


def stood(messages: Messages) -> Messages:
    """The recorder's clock stands."""
    return [(topic, kind, stamps_ns(np.zeros(1))[0], message) for topic, kind, _, message in messages]


BACKWARDS = ["wrist", "elbow", "shoulder"]
CASES = (
    Case("packed", packed, "Unpack it first", unpacked),
    Case("a type without definition", strange_type, "ros2 bag convert", converted),
    Case(
        "two publishers",
        recording(lambda: with_other(["elbow", "shoulder", "wrist"])),
        r"60 messages with \[wrist, elbow, shoulder\] .*and 60 messages with \[elbow, shoulder, wrist\]",
        settings,
    ),
    Case(
        "two publishers of one order",
        recording(lambda: with_other(BACKWARDS), lambda t: t["columns"].pop("joint_vel")),
        "Those that have velocity are read with",
        settings,
    ),
    Case(
        "an order of nobody",
        recording(plain, putting(order={"/joint_states": list(ARM_JOINTS)})),
        "must be the names in the messages",
        lambda a, line: a.map.update(order={"/command": BACKWARDS, "/joint_states": BACKWARDS}),
    ),
    Case("no order", recording(plain, without("order")), "order: .*nothing stated", settings),
    Case(
        "half an order",
        recording(plain, putting(order={"/command": ["elbow", "wrist"]})),
        "came elbow, wrist",
        settings,
    ),
    Case(
        "an empty column",
        recording(plain, putting(joint_torque="/joint_states:effort")),
        "Take joint_torque out of the map's columns",
        lambda a, line: a.map["columns"].pop("joint_torque"),
    ),
    Case(
        "other names",
        recording(lambda: joint_messages(arm_rollout(0, seconds=1.2), ("j1", "j2", "j3"))),
        "`names`",
        named,
    ),
    Case("no header", recording(plain, putting(time="header")), "`time: log`", settings),
    Case("no stamp in the header", recording(unstamped, putting(time="header")), "`time: log`", settings),
    Case(
        "a clock set back beside one that runs",
        recording(lambda: set_back(with_header(plain()))),
        "`time: header`",
        settings,
    ),
    Case(
        "a clock set back",
        recording(lambda: set_back(plain())),
        "a step of -1.38 s at message 75.*`episodes: split`",
        settings,
    ),
    Case(
        "a clock that stands",
        recording(lambda: stood(with_header(plain(1.2)))),
        "in 59 of 60.*`time: header`",
        settings,
    ),
    Case(
        "no unit",
        recording(plain, without("angle_unit")),
        "angle_unit.*state it",
        lambda a, line: a.map.update(angle_unit="rad"),
    ),
    Case(
        "no clock",
        recording(plain, without("time")),
        "header or log.*state it",
        lambda a, line: a.map.update(time="log"),
    ),
)
