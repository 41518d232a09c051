"""All settings that params.yaml reaches: their classes, their fields, and the file with one of them changed."""

import copy
import typing
from collections.abc import Iterator
from dataclasses import is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

from bumblebee.ranges import annotations
from tasks import sections
from tasks.settings import params

HOME = Path(sections.__file__).parents[1]


def classes() -> list[type]:
    """Every settings class, each once."""
    waiting: list[Any] = [sections.Loop]
    for place in params.SECTIONS.values():
        module, _, name = place.partition(":")
        waiting.append(getattr(import_module(module), name))
    found: list[type] = []
    while waiting:
        kind = waiting.pop(0)
        if isinstance(kind, type) and is_dataclass(kind) and kind not in found:
            found.append(kind)
            waiting += annotations(kind).values()
        waiting += [inner for inner in get_args(kind) if not isinstance(inner, str)]
    return found


def bare(kind: Any) -> Any:
    """The type inside an annotation."""
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def leaves(kind: Any) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """The scalar types in an annotation, each with what is annotated beside it."""
    if get_origin(kind) is Annotated:
        inner, *meta = get_args(kind)
        if not get_args(inner):
            yield inner, tuple(meta)
            return
        kind = inner
    if get_origin(kind) is typing.Literal or is_dataclass(kind):
        return
    inside = [inner for inner in get_args(kind) if inner is not Ellipsis]
    if not inside:
        yield kind, ()
    for inner in inside:
        yield from leaves(inner)


def shipped() -> dict[str, Any]:
    """params.yaml of the checkout."""
    return params.read(HOME / "params.yaml")


def changed(content: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """A copy with the value at the dotted key replaced, sections on the way made where there are none."""
    content = copy.deepcopy(content)
    *path, last = key.split(".")
    place = content
    for name in path:
        place = place.setdefault(name, {})
    place[last] = value
    return content
