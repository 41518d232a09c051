"""Ranges beside the fields of settings: `Annotated[float, Range(above=0, most=1)]`, held whoever makes an instance.

A settings class is a frozen dataclass on top of `Ranged`. `tasks.settings.params` holds a file to the same ranges,
and names the key. NaN and infinities are in no range.
"""

import math
import types
import typing
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from functools import cache
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

from bumblebee.errors import BadInput

SHOWN = 80  # signs of a value in a message


@dataclass(frozen=True)
class Range:
    """The numbers from `least` or above `above` to `most` or below `below`; finite ones, whatever it says."""

    least: float | None = None
    above: float | None = None
    most: float | None = None
    below: float | None = None

    def holds(self, value: Any) -> bool:
        """Whether a number lies within."""
        if not -math.inf < value < math.inf:
            return False
        low = (self.least is None or value >= self.least) and (self.above is None or value > self.above)
        return low and (self.most is None or value <= self.most) and (self.below is None or value < self.below)

    def __str__(self) -> str:
        if self.least is not None and self.most is not None:
            return f"from {_plain(self.least)} to {_plain(self.most)}"
        words = (("of at least", self.least), ("above", self.above), ("at most", self.most), ("below", self.below))
        return ", ".join(f"{word} {_plain(bound)}" for word, bound in words if bound is not None)


@dataclass(frozen=True)
class Size:
    """How many elements a list or mapping has."""

    least: int = 1
    most: int = 1000

    def holds(self, value: Any) -> bool:
        """Whether there are so many."""
        return self.least <= len(value) <= self.most

    def __str__(self) -> str:
        return f"of {self.least:,} to {self.most:,}"


@dataclass(frozen=True)
class Text:
    """A name, a path or a line of text: no line breaks, no control characters."""

    empty: bool = False
    most: int = 1000

    def holds(self, value: Any) -> bool:
        """Whether a text is such a line."""
        said = str(value)
        plain = not any(unicodedata.category(sign) in ("Cc", "Cs", "Zl", "Zp") for sign in said)
        return plain and len(said) <= self.most and (self.empty or bool(said.strip()))

    def __str__(self) -> str:
        return f"of one line, at most {self.most:,} signs" + (", or empty" if self.empty else "")


Count = Annotated[int, Range(least=1, most=1_000_000)]
"""So many, at least one."""
Few = Annotated[int, Range(least=1, most=1000)]
"""Number of something costly: passes, repeats, threads, GPUs."""
Seed = Annotated[int, Range(least=0, most=2**31 - 1)]
"""Seed that torch, NumPy and scikit-learn all take."""
Share = Annotated[float, Range(least=0, most=1)]
"""A part of the whole, from none to all."""
PartOf = Annotated[float, Range(least=0, below=1)]
"""A part of the whole that leaves some of it."""
Factor = Annotated[float, Range(least=0, most=1000)]
"""Factor that something is multiplied by; 0 switches it off."""
Positive = Annotated[float, Range(above=0, most=1000)]
"""More than nothing."""
Seconds = Annotated[float, Range(above=0, most=3600)]
"""A length of time [s]."""
Rate = Annotated[float, Range(above=0, most=1)]
"""A learning rate."""
Weight = Annotated[float, Range(least=-1e6, most=1e6)]
"""Weight of a term in a sum; negative where it punishes."""
Widths = Annotated[tuple[Annotated[int, Range(least=1, most=65_536)], ...], Size(most=32)]
"""Units of a network's hidden layers."""
Name = Annotated[str, Text()]
"""A name that is not empty."""
Line = Annotated[str, Text(empty=True)]
"""A line that may be empty."""
Place = Annotated[Path, Text()]
"""A file or folder."""


class Unfit(BadInput, ValueError):
    """Settings out of their range, or that do not fit together.

    Args:
        kind: the settings' class.
        field: which field.
        expected: what would have been accepted.
        came: the value.
    """

    def __init__(self, kind: type, field: str, expected: str, came: Any) -> None:
        self.field = field
        super().__init__(f"{kind.__name__}.{field}", expected, shown(came))


class Ranged:
    """Settings that hold their fields' ranges; a class that also compares fields extends `__post_init__`."""

    def __post_init__(self) -> None:
        """Hold every field to its annotation.

        Raises:
            Unfit: for the first one outside.
        """
        for name, kind in annotations(type(self)).items():
            if found := fault(kind, getattr(self, name), name):
                place, expected, came = found
                raise Unfit(type(self), place, expected, came)

    def require(self, holds: bool, field: str, expected: str) -> None:
        """Refuse a field that does not fit to the others.

        Raises:
            Unfit: where `holds` is false.
        """
        if not holds:
            raise Unfit(type(self), field, expected, getattr(self, field))

    def require_names(self, field: str, known: typing.Iterable[str]) -> None:
        """Refuse a name in the list `field` that is none of the known ones, or that stands there twice."""
        names, known = list(getattr(self, field)), list(known)
        for name in names:
            if name not in known or names.count(name) > 1:
                among = ", ".join(known[:8]) + (" ..." if len(known) > 8 else "")
                raise Unfit(type(self), field, f"distinct names among {among}", name)

    def require_order(self, field: str) -> None:
        """Refuse a pair whose first number is the larger one."""
        low, high = getattr(self, field)
        self.require(low <= high, field, "the smaller number first")


def annotations(kind: type) -> dict[str, Any]:
    """The annotation of each field of a dataclass, ranges included."""
    return _annotations(kind)


@cache
def _annotations(kind: type) -> dict[str, Any]:
    hints = typing.get_type_hints(kind, include_extras=True)
    return {name: hints[name] for name in getattr(kind, "__dataclass_fields__", {})}


def fault(kind: Any, value: Any, place: str) -> tuple[str, str, Any] | None:
    """The first thing in `value` that its annotation does not allow: place, what was expected, what came."""
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        found = fault(args[0], value, place)
        if found is None and not all(meta.holds(value) for meta in args[1:]):
            return place, describe(kind), value
        return (place, describe(kind), value) if found and found[0] == place else found
    if origin in (typing.Union, types.UnionType):
        faults = [fault(option, value, place) for option in args]
        deeper = [found for found in faults if found and found[0] != place]
        wrong = (deeper or [(place, describe(kind), value)])[0]
        return None if None in faults else wrong
    inside: list[tuple[Any, Any, str]] = []
    if origin in (tuple, list):
        inner = element_kinds(origin, args, len(value)) if isinstance(value, list | tuple) else None
        if inner is None:
            return place, describe(kind), value
        inside = [(k, v, f"{place}[{i}]") for i, (k, v) in enumerate(zip(inner, value, strict=True))]
    elif origin is dict and isinstance(value, Mapping):
        for key, held in value.items():
            inside += [(args[0], key, place), (args[1], held, f"{place}.{shown(key, bare=True)}")]
    elif not _is_a(kind, origin, args, value):
        return place, describe(kind), value
    return next((found for k, v, p in inside if (found := fault(k, v, p))), None)


def _is_a(kind: Any, origin: Any, args: tuple[Any, ...], value: Any) -> bool:
    """Whether a value is of a type that has no parts; NumPy's numbers are numbers."""
    if kind is Any:
        return True
    if origin is typing.Literal:
        return any(value is option or (type(value) is type(option) and value == option) for option in args)
    if kind in (int, float):
        return isinstance(value, Integral if kind is int else Real) and not isinstance(value, bool)
    if kind is Path:
        return isinstance(value, str | PathLike)
    return isinstance(value, kind) if isinstance(kind, type) else False


def element_kinds(origin: Any, args: tuple[Any, ...], length: int) -> list[Any] | None:
    """The type of each element; None where the number of elements does not fit."""
    if not args:
        return [Any] * length
    if origin is list or (len(args) == 2 and args[1] is Ellipsis):
        return [args[0]] * length
    return list(args) if len(args) == length else None


def describe(kind: Any) -> str:
    """Range of an annotation, in words."""
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return " ".join([describe(args[0]), *map(str, args[1:])])
    if origin is typing.Literal:
        return "one of " + ", ".join(map(str, args))
    if origin in (typing.Union, types.UnionType):
        return " or ".join("nothing" if a is type(None) else describe(a) for a in args)
    if origin is tuple and args and args[-1] is not Ellipsis:
        each = "values" if len(set(args)) > 1 else f"values, {describe(args[0])} each"
        return f"a list of {len(args)} {each if get_origin(args[0]) is Annotated else 'values'}"
    if origin in (tuple, list):
        base = get_args(args[0])[0] if args and get_origin(args[0]) is Annotated else args[0] if args else None
        return "a list of " + _plural(base) if args else "a list"
    if is_dataclass(kind) or origin is dict:
        return "keys and values"
    names = {int: "a whole number", float: "a number", str: "text", bool: "true or false", Path: "a path"}
    return names.get(kind, getattr(kind, "__name__", str(kind)))


def _plural(kind: Any) -> str:
    """Elements of a list in words."""
    return {int: "whole numbers", float: "numbers", str: "texts"}.get(kind, f"{describe(kind)} values")


def shown(value: Any, bare: bool = False) -> str:
    """A value for a message, however long it is; `bare` without quotation marks, for keys."""
    try:
        said = str(value) if bare else repr(value)
    except ValueError:  # whole numbers of more digits than Python writes
        said = "a very large number"
    return said if len(said) <= SHOWN else f"{said[:SHOWN]} ..."


def _plain(bound: float) -> str:
    return f"{bound:,.12g}"
