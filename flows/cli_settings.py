"""Command line: `bumblebee settings`; every key of params.yaml with its default, what it may be and its meaning."""

import inspect
import re
import sys
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields, is_dataclass
from importlib import import_module
from itertools import accumulate
from typing import Annotated, Any, get_args

import typer


def settings(
    section: Annotated[str, typer.Argument(metavar="[SECTION]", help="A section, or a part of it: base.ppo.")] = "",
) -> None:
    """Print every key with its default, what it may be, and its meaning.

    The file that one edits is params.yaml, in the checkout or in runs/NAME/.
    """
    from bumblebee.errors import BadInput
    from tasks.settings.params import SECTIONS, nearest

    if section:
        first = section.split(".")[0]
        if first not in SECTIONS:
            do = nearest(first, SECTIONS) or "`bumblebee settings` prints all."
            raise BadInput(section, f"a section among {', '.join(SECTIONS)}", "none of them", do)
    rows = [row for name in SECTIONS for row in keys(name, _class(name)) if _under(row[0], section)]
    if not rows:
        known = [part for row in keys(first, _class(first)) for part in accumulate(row[0].split("."), "{}.{}".format)]
        raise BadInput(section, f"a key of `{first}`", "an unknown one", nearest(section, known))
    for key, default, allowed, meaning in rows:
        print(f"{key}: {default}   # {allowed}\n    {meaning}")


def _under(key: str, section: str) -> bool:
    return not section or f"{key}.".startswith(f"{section}.")


def _class(section: str) -> type:
    from tasks.settings.params import SECTIONS

    module, _, name = SECTIONS[section].partition(":")
    return getattr(import_module(module), name)


def keys(place: str, kind: type, made: Any = None) -> Iterator[tuple[str, str, str, str]]:
    """Rows of a settings class, those of classes in it too: key, default, what it may be, meaning.

    Args:
        place: the class's own key.
        kind: the class.
        made: its defaults in the section that it stands in; None for the class's own.
    """
    from bumblebee.ranges import annotations, describe

    said = meanings(kind)
    for field in fields(kind):
        if not field.init:
            continue
        hint, name = annotations(kind)[field.name], f"{place}.{field.name}"
        inner = next((one for one in (hint, *get_args(hint)) if isinstance(one, type) and is_dataclass(one)), None)
        if inner is not None:
            yield from keys(name, inner, _default(field, made))
        else:
            yield name, _shown(_default(field, made)), describe(hint), said.get(field.name, "")


def _default(field: "Field[Any]", made: Any) -> Any:
    if made is not None:
        return getattr(made, field.name)
    return field.default_factory() if field.default_factory is not MISSING else field.default


def _shown(value: Any) -> str:
    if value is MISSING:
        return "(must be given)"
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "null"}[value]
    return str(list(value)) if isinstance(value, tuple) else str(value) if value != "" else '""'


def meanings(kind: type) -> dict[str, str]:
    """Field -> the text that stands below it in the source, that of parent classes too."""
    found: dict[str, str] = {}
    for cls in reversed(kind.__mro__):
        if cls is object or "__dataclass_fields__" not in vars(cls):
            continue
        module = sys.modules[cls.__module__]
        text = inspect.getsource(cls) if module else ""
        pairs = re.findall(r'^    (\w+):[^\n]*(?:\n(?!    \w+:|    """)[^\n]*)*?\n    """(.*?)"""', text, re.M | re.S)
        found |= {name: " ".join(said.split()) for name, said in pairs}
    return found
