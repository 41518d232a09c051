"""The messages of one topic as series of numbers, the joints in the map's order."""

from array import array
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.column_map import LEFT_OUT, NAMED, ColumnMap
from bumblebee.measured.importers.ros.fields import Step, decoder, field_of, filled_lists, names_in, numbers
from bumblebee.measured.importers.ros.grid import Series
from bumblebee.measured.importers.ros.publishers import Kind, Part, counted, flow
from bumblebee.measured.importers.ros.recording import Message, Topic
from bumblebee.measured.importers.unitree import MODE

_WHOLE = -1


@dataclass(frozen=True)
class Wanted:
    """One column, or one joint's part of it, of a topic."""

    column: str
    path: tuple[Step, ...]
    part: int = _WHOLE
    """Which joint or component it is, where the map names a topic for each."""


def series_of(where: str, name: str, topic: Topic, wanted: list[Wanted], chosen: ColumnMap) -> list[Series]:
    """The series of each wanted column: one, or one for each group of joints that comes in messages of its own.

    Raises:
        BadInput: a field that is not there, joints that the messages lack or whose order nobody says, no stamps, two
            publishers of one joint.
    """
    parts, notes = counted(where, name, _parts(where, name, topic, wanted, chosen), chosen)
    for one in (one for one in wanted if NAMED[one.column] == "J" and one.part == _WHOLE):
        _require_joints(f"{where}: {one.column}", parts, chosen)
    series = [
        made
        for part in parts
        for number in range(len(wanted))
        if (made := _series(f"{where}, message {part.first}", name, topic.kind, part, number, wanted, chosen))
    ]
    return [replace(series[0], notes=notes), *series[1:]]


def _parts(where: str, name: str, topic: Topic, wanted: list[Wanted], chosen: ColumnMap) -> list[Part]:
    """The numbers of all messages; they are decoded one by one, since many of them fill the memory."""
    decode = decoder(where, topic)
    clock = chosen.clock.get(name, chosen.clock.get("", "log"))
    found: dict[Kind, Part] = {}
    for number, raw in enumerate(topic.messages):
        place = f"{where}, message {number}"
        message = _decoded(place, decode, raw)
        _require_pitch_and_roll(place, topic.kind, message)
        values = [_numbers(f"{place}: {one.column}", message, one, chosen) for one in wanted]
        named = names_in(message)
        kind = Kind(named, filled_lists(message) if named else (), tuple(map(len, values)))
        part = found.setdefault(kind, Part(kind, number, values=[array("d") for _ in wanted]))
        part.stamps.append(_stamp(place, clock, raw, message))
        part.numbers.append(raw.place)
        for held, one in zip(part.values, values, strict=True):
            held.extend(one)
    return list(found.values())


def _numbers(where: str, message: Any, one: Wanted, chosen: ColumnMap) -> list[float]:
    values = numbers(where, message, one.path)
    if one.column == "base_quat" and len(values) == 4 and chosen.quat_order == "wxyz" and _axes(message, one):
        return [values[3], *values[:3]]
    return values


def _series(
    where: str, name: str, kind: str, part: Part, number: int, wanted: list[Wanted], chosen: ColumnMap
) -> Series | None:
    """One wanted column of one kind of messages; None where they hold none of its joints."""
    one, count = wanted[number], part.kind.lengths[number]
    values = np.frombuffer(part.values[number]).reshape(len(part.stamps), count)
    where = f"{where}: {one.column}"
    if NAMED[one.column] == "J" and one.part == _WHOLE:
        places = _places(where, name, kind, part.kind.names, count, chosen)
        if not places:
            return None
        ours, values = tuple(places), values[:, list(places.values())]
    else:
        ours = tuple(range(chosen.width(one.column))) if one.part == _WHOLE else (one.part,)
        if count != len(ours):
            raise BadInput(where, f"{len(ours)} numbers", str(count))
    stamps, order = (np.frombuffer(held, dtype=np.int64) for held in (part.stamps, part.numbers))
    return Series(one.column, name, stamps, values, ours, order)


def _decoded(where: str, decode: Callable[[bytes], Any], raw: Message) -> Any:
    try:
        return decode(raw.data)
    except Exception as error:  # struct.error, ValueError, UnicodeDecodeError, RecursionError, MemoryError
        raise BadInput(where, "a message of its type", f"{type(error).__name__}: {error}"[:160]) from None


def _stamp(where: str, clock: str, raw: Message, message: Any) -> int:
    """[ns] by the clock that the map chose."""
    if clock != "header":
        stamp = raw.published if clock == "publish" else raw.logged
    else:
        if "header" not in getattr(type(message), "__slots__", ()):
            do = "Say `time: log`, or `time: {topic: log}` for this one and another for the others."
            raise BadInput(where, "a header, as the map's time says", "a message without", do)
        said = field_of(where, field_of(where, message, "header"), "stamp")
        seconds, rest = (field_of(where, said, name) for name in ("sec", "nanosec"))
        if not isinstance(seconds, int) or not isinstance(rest, int):
            raise BadInput(f"{where}: header.stamp", "whole seconds and nanoseconds", type(seconds).__name__)
        stamp = seconds * 10**9 + rest
        if stamp == 0:
            raise BadInput(f"{where}: header.stamp", "a stamp", "0, which nobody set", "Say `time: log`.")
    if not 0 <= stamp < 2**62:
        raise BadInput(where, "nanoseconds since 1970 or since a start", str(stamp)[:40])
    return stamp


def _places(where: str, name: str, kind: str, named: tuple[str, ...], count: int, chosen: ColumnMap) -> dict[int, int]:
    """Joint of the map -> where it stands among `count` values; of messages with names those that they hold."""
    if named and not set(named) & set(chosen.names or chosen.joints):
        return {}
    if named and len(named) != count:
        do = f"Take {where.rpartition(': ')[2]} out of the map's columns."
        raise BadInput(where, f"{len(named)} values, one for each name", str(count), do)
    order, asked = (named, chosen.names) if named else (chosen.order.get(name, ()), ())
    said = {
        place: order.index(theirs)
        for place, (ours, theirs) in enumerate(zip(chosen.joints, asked or chosen.joints, strict=True))
        if ours != LEFT_OUT and theirs in order
    }
    enough = len(order) == count or (len(order) < count and kind.startswith("unitree_"))
    if not named and (not enough or len(said) < len([joint for joint in chosen.joints if joint != LEFT_OUT])):
        example = flow({name: [*chosen.joints, *[LEFT_OUT] * (count - len(chosen.joints))]})
        do = f"`order: {example}` if they come so; `{LEFT_OUT}` is a value of no joint." * (count >= len(chosen.joints))
        raise BadInput(
            f"{where}: order",
            f"the joints in the order of {name}'s {count} values",
            ", ".join(order)[:200] or "nothing stated",
            do,
        )
    return said


def _require_joints(where: str, parts: list[Part], chosen: ColumnMap) -> None:
    """Every joint of the map is in some of the messages, where they have names."""
    there = list(dict.fromkeys(name for part in parts for name in part.kind.names))
    asked = zip(chosen.joints, chosen.names or chosen.joints, strict=True)
    lacking = [ours for ours, theirs in asked if ours != LEFT_OUT and there and theirs not in there]
    if lacking:
        do = f"List under `names` what the messages call {', '.join(chosen.joints)}, in this order."
        raise BadInput(where, f"joint {lacking[0]}"[:80], f"only {', '.join(there)}"[:300], do)


def _axes(message: Any, one: Wanted) -> bool:
    """Whether a quaternion comes as fields x, y, z, w, whose order needs no telling, and not as four numbers."""
    for name, which in one.path:
        if which is not None:
            return False
        message = getattr(message, name)
    return "w" in getattr(type(message), "__slots__", ())


def _require_pitch_and_roll(where: str, kind: str, message: Any) -> None:
    """Motors that are driven apart are no joints of the model."""
    if kind.startswith("unitree_hg/") and getattr(message, MODE, 0) != 0:
        raise BadInput(f"{where}: {MODE}", "0, ankles and waist as pitch and roll", str(getattr(message, MODE))[:20])
