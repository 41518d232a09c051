"""Content of both storages of rosbag2: topics with their types, and messages as bytes with two stamps."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits

LARGEST = 1 << 20  # bytes of one message of joints; Unitree's low state has some 1.3 kB


@dataclass(frozen=True)
class Message:
    """One message as it lies in the file."""

    logged: int
    """When the recorder wrote it [ns]."""
    published: int
    """When it was sent [ns], where the storage has it; else `logged`."""
    data: bytes
    """CDR."""
    place: int = 0
    """Its number among the file's messages, of whatever topic."""


@dataclass
class Topic:
    """The messages of one topic in the file's order."""

    kind: str
    """Type, as `sensor_msgs/msg/JointState`."""
    definition: str
    """In the form `ros2msg`; empty where the storage has none."""
    messages: list[Message] = field(default_factory=list)


@dataclass
class Recording:
    """The wanted topics of one recording."""

    topics: dict[str, Topic]
    others: dict[str, str]
    """Topics that were not asked for -> type."""
    notes: tuple[str, ...] = ()


def merged(parts: Iterable[Recording]) -> Recording:
    """Files that rosbag2 split one recording into, as one."""
    whole, before = Recording({}, {}), 0
    for part in parts:
        for name, topic in part.topics.items():
            moved = [replace(one, place=one.place + before) for one in topic.messages] if before else topic.messages
            whole.topics.setdefault(name, Topic(topic.kind, topic.definition)).messages.extend(moved)
        before += 1 + max((one.place for topic in part.topics.values() for one in topic.messages), default=0)
        whole.others |= part.others
        whole.notes += part.notes
    return whole


def require_small(where: str, topic: str, size: int, limits: Limits, total: int) -> None:
    """Refuse a message, or a sum of them, that no log of joints has."""
    if size > LARGEST:
        raise BadInput(f"{where}: {topic}", f"messages of at most {LARGEST:,} bytes", f"{size:,}")
    if total > limits.unpacked_bytes:
        raise BadInput(where, f"at most {limits.unpacked_bytes:,} bytes of messages", f"{total:,}")
