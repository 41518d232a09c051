"""Whose messages on a topic count: joints that come in messages apart are put together, publishers are told apart.

Messages of one publisher have the same names in the same order. Where messages with other names share no joint with
them, as those of an arm and of its gripper, all of them count. Where they do, the map must say whose count.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import yaml

from bumblebee.errors import BadInput
from bumblebee.measured.importers.column_map import ColumnMap

_COLUMNS = {"position": "joint_pos", "velocity": "joint_vel", "effort": "joint_torque"}


@dataclass(frozen=True)
class Kind:
    """How the messages of one publisher look."""

    names: tuple[str, ...]
    """Names of the joints; empty where the messages have none."""
    filled: tuple[str, ...]
    """Their lists that are not empty."""
    lengths: tuple[int, ...]
    """Numbers of every wanted column."""


@dataclass
class Part:
    """The messages of one kind."""

    kind: Kind
    first: int
    """Which message of the topic is the first of them."""
    stamps: array = field(default_factory=lambda: array("q"))
    """[ns]."""
    numbers: array = field(default_factory=lambda: array("q"))
    """The messages' numbers in the file."""
    values: list[array] = field(default_factory=list)
    """Numbers of every wanted column, message after message."""


def counted(where: str, topic: str, parts: Sequence[Part], chosen: ColumnMap) -> tuple[list[Part], tuple[str, ...]]:
    """The parts that count, and notes on those that do not.

    Raises:
        BadInput: two kinds of messages hold the same joint of the map, and it does not say which of them counts.
    """
    asked, order = set(chosen.names or chosen.joints), chosen.order.get(topic, ())
    kept = [p for p in parts if p.kind.names == order or not set(order) & set(p.kind.names)]
    if not kept:
        came = "; ".join(", ".join(part.kind.names) for part in parts)[:300]
        do = "The list must be the names in the messages, in their order."
        raise BadInput(f"{where}: order", f"messages with {', '.join(order)}"[:300], came, do)
    kept = [p for p in kept if 0 not in p.kind.lengths or not any(_fuller(q.kind, p.kind) for q in kept)]
    named = [part for part in kept if asked & set(part.kind.names)]
    for k, part in enumerate(named):
        for other in named[:k]:
            if asked & set(part.kind.names) & set(other.kind.names):
                raise _two_publishers(where, topic, other, part)
    notes = [
        f"{topic}: {len(part.stamps)} messages with {', '.join(part.kind.names)} left out, of another publisher"
        for part in parts
        if part not in kept
    ]
    if len(named) > 1:
        notes.append(f"{topic}: put together from messages with {' and with '.join(_listed(p) for p in named)}")
    return kept, tuple(notes)


def _fuller(one: Kind, other: Kind) -> bool:
    """Whether messages with the same names have what `other` lacks."""
    return one.names == other.names and 0 not in one.lengths


def _two_publishers(where: str, topic: str, one: Part, other: Part) -> BadInput:
    best, rest = sorted((one, other), key=lambda part: (len(part.kind.filled), len(part.stamps)), reverse=True)
    came = " and ".join(
        f"{len(part.stamps)} messages with {_listed(part)} ({', '.join(part.kind.filled)})" for part in (best, rest)
    )
    do = f"Say in the map whose messages count: `order: {flow({topic: list(best.kind.names)})}`."
    if one.kind.names == other.kind.names:
        more = next((name for name in best.kind.filled if name in _COLUMNS and name not in rest.kind.filled), "")
        do = f"Those that have {more} are read with `{_COLUMNS[more]}: {topic}:{more}` under `columns`." if more else ""
    return BadInput(where, "messages of one publisher for each joint", came, do)


def _listed(part: Part) -> str:
    return f"[{', '.join(part.kind.names)}]"


def flow(value: object) -> str:
    """A value as YAML in one line, as a map may have it."""
    return yaml.safe_dump(value, default_flow_style=True, width=float("inf"), allow_unicode=True).strip()
