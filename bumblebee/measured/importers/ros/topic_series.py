"""The messages of one topic as series of numbers, the joints in the map's order."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.column_map import LEFT_OUT, NAMED, ColumnMap
from bumblebee.measured.importers.ros.fields import Step, decoder, field_of, names_in, numbers
from bumblebee.measured.importers.ros.grid import Series
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
    """A series for each wanted column; messages are decoded one by one, since many of them fill the memory.

    Raises:
        BadInput: a field that is not there, joints that the messages lack or whose order nobody says, no stamps.
    """
    decode = decoder(where, topic)
    clock = chosen.clock.get(name, chosen.clock.get("", "log"))
    stamps = np.empty(len(topic.messages), dtype=np.int64)
    rows = [np.empty((len(topic.messages), _width(one, chosen))) for one in wanted]
    places: dict[tuple[str, tuple[str, ...], int], np.ndarray] = {}
    for number, raw in enumerate(topic.messages):
        place = f"{where}, message {number}"
        message = _decoded(place, decode, raw)
        _require_pitch_and_roll(place, topic.kind, message)
        stamps[number] = _stamp(place, clock, raw, message)
        named = names_in(message)
        for one, out in zip(wanted, rows, strict=True):
            values = numbers(f"{place}: {one.column}", message, one.path)
            if NAMED[one.column] == "J" and one.part == _WHOLE:
                key = (one.column, named, len(values))
                if key not in places:
                    places[key] = _places(f"{place}: {one.column}", name, topic.kind, named, len(values), chosen)
                values = np.append(values, 0.0)[places[key]]
            elif one.column == "base_quat" and len(values) == 4 and chosen.quat_order == "wxyz" and _axes(message, one):
                values = [values[3], *values[:3]]
            if len(values) != out.shape[1]:
                raise BadInput(f"{place}: {one.column}", f"{out.shape[1]} numbers", str(len(values)))
            out[number] = values
    return [Series(one.column, name, stamps, out) for one, out in zip(wanted, rows, strict=True)]


def _width(one: Wanted, chosen: ColumnMap) -> int:
    return chosen.width(one.column) if one.part == _WHOLE else 1


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


def _places(where: str, name: str, kind: str, named: tuple[str, ...], count: int, chosen: ColumnMap) -> np.ndarray:
    """(J,) where each joint of the map stands among `count` values; the one past the end for a joint left out."""
    asked = chosen.names or chosen.joints
    if named:
        if len(named) != count:
            expected = f"{len(named)} values, one for each name"
            raise BadInput(where, expected, str(count), "Where the messages lack it, take it out of the map.")
        order = named
    else:
        order, asked = chosen.order.get(name, ()), chosen.joints
        if not order:
            raise BadInput(f"{where}: order", f"the joints in the order of {name}'s {count} values", "nothing stated")
        if len(order) > count or (len(order) < count and not kind.startswith("unitree_")):
            raise BadInput(f"{where}: order", f"{count} joints (`{LEFT_OUT}` for others)", str(len(order)))
    lacking = [
        joint for joint, theirs in zip(chosen.joints, asked, strict=True) if joint != LEFT_OUT and theirs not in order
    ]
    if lacking:
        do = "What the messages call the joints goes under `names`, or their order under `order`."
        raise BadInput(where, f"joint {lacking[0]}"[:80], f"only {', '.join(order)}"[:300], do)
    return np.array(
        [count if ours == LEFT_OUT else order.index(theirs) for ours, theirs in zip(chosen.joints, asked, strict=True)]
    )


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
