"""Numbers out of decoded messages: `motor_state[].q`, `points[0].positions`, `orientation`, and whose they are."""

import re
from collections.abc import Callable, Sequence
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.measured.importers.extras import library
from bumblebee.measured.importers.ros.recording import Topic

NAME_FIELDS = ("name", "joint_names")
"""Fields with the joints' names: of JointState; of JointTrajectory and of a controller's state."""
_STEP = re.compile(r"([A-Za-z]\w*)(\[(\d*)\])?")
_ALL = -1
_DEFINITION = 1 << 16  # bytes of a type's definition; a controller's state has 3 kB
_ELEMENTS = 1 << 16  # of an array of fixed size

Step = tuple[str, int | None]
"""Name of a field; then the whole of it (None), all its elements in turn (_ALL), or one element."""


def steps(where: str, path: str) -> tuple[Step, ...]:
    """The steps of a path of fields."""
    out: list[Step] = []
    for part in path.split("."):
        match = _STEP.fullmatch(part)
        if not match:
            raise BadInput(where, "fields such as position, motor_state[].q or points[0].positions", repr(path)[:80])
        number = match.group(3)
        out.append((match.group(1), None if number is None else int(number[:9]) if number else _ALL))
    return tuple(out)


def decoder(where: str, topic: Topic) -> Callable[[bytes], Any]:
    """Decoder of a topic's messages: bytes into objects with its type's fields.

    Raises:
        BadInput: a definition that cannot be read, or by which a message could hold more elements than bytes.
    """
    text = topic.definition
    sizes = [int(digits[:12]) for digits in re.findall(r"\[(\d+)\]", text)]
    if len(text) > _DEFINITION or any(not 0 < size <= _ELEMENTS for size in sizes):
        raise BadInput(
            where, f"a type of at most {_DEFINITION:,} characters and arrays of 1 to {_ELEMENTS:,}", topic.kind[:80]
        )
    records, ros = library("rosbag", "mcap.records"), library("rosbag", "mcap_ros2.decoder")
    schema = records.Schema(id=1, name=topic.kind, encoding="ros2msg", data=text.encode())
    try:
        decode = ros.DecoderFactory().decoder_for("cdr", schema)
    except Exception as error:  # the parser of definitions raises classes of its own
        raise BadInput(where, f"a definition of {topic.kind}"[:120], f"{type(error).__name__}: {error}"[:160]) from None
    if decode is None:
        raise BadInput(where, f"a definition of {topic.kind}"[:120], "none that can be read")
    return decode


def numbers(where: str, message: Any, path: Sequence[Step]) -> list[float]:
    """The numbers at a path of a decoded message, in its order; of x, y, z and w in this one."""
    if not path:
        return _flat(where, message)
    (name, which), rest = path[0], path[1:]
    value = field_of(where, message, name)
    if which is None:
        return numbers(where, value, rest)
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise BadInput(f"{where}: {name}", "a list of elements", type(value).__name__)
    if which == _ALL:
        return [number for element in value for number in numbers(where, element, rest)]
    if which >= len(value):
        raise BadInput(f"{where}: {name}", f"element {which}", f"{len(value)} elements")
    return numbers(where, value[which], rest)


def field_of(where: str, message: Any, name: str) -> Any:
    """A field of a decoded message."""
    names = getattr(type(message), "__slots__", ())
    if name not in names:
        came = ", ".join(map(str, list(names)[:40])) or "a number or a text"
        raise BadInput(f"{where}: {name}", "this field", f"only {came}"[:300])
    return getattr(message, name)


def names_in(message: Any) -> tuple[str, ...]:
    """Names of the joints, where the message says them; else nothing."""
    for name in NAME_FIELDS:
        if name in getattr(type(message), "__slots__", ()):
            said = getattr(message, name)
            if isinstance(said, list) and all(isinstance(one, str) for one in said):
                return tuple(said)
    return ()


def filled_lists(message: Any) -> tuple[str, ...]:
    """A message's own lists that are not empty, but for the joints' names."""
    fields = {name: getattr(message, name) for name in type(message).__slots__ if name not in NAME_FIELDS}
    return tuple(
        name for name, value in fields.items() if isinstance(value, Sequence) and not isinstance(value, str) and value
    )


def _flat(where: str, value: Any) -> list[float]:
    if isinstance(value, bool | int | float):
        return [float(value)]
    slots = getattr(type(value), "__slots__", ())
    if {"x", "y", "z"} <= set(slots):
        return [
            number for axis in ("x", "y", "z", "w") if axis in slots for number in _flat(where, getattr(value, axis))
        ]
    if isinstance(value, str | bytes) or not hasattr(value, "__iter__"):
        raise BadInput(where, "numbers", f"a field that holds {', '.join(map(str, slots))[:200] or 'text'}")
    return [number for one in value for number in _flat(where, one)]
