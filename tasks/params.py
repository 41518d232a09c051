"""One section of params.yaml as the frozen dataclass of its stage: every key known, present and of its type."""

import difflib
import re
import types
import typing
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

import yaml

from bumblebee.errors import BadInput

FILE = Path("params.yaml")
EXPONENT = re.compile(r"[-+]?[0-9]+e[-+]?[0-9]+", re.IGNORECASE)
Config = TypeVar("Config")


def read(path: Path = FILE) -> dict[str, Any]:
    """The whole of params.yaml as plain data.

    Raises:
        BadInput: when the file is missing or is not a YAML mapping.
    """
    try:
        content = yaml.safe_load(path.read_text())
    except FileNotFoundError:
        raise BadInput(path, "a file with the parameters", "no file", "Run in the folder that holds it.") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{path}, line {mark.line + 1}" if mark else path
        raise BadInput(where, "YAML", str(getattr(error, "problem", error))) from None
    if not isinstance(content, dict):
        raise BadInput(path, "sections of parameters", type(content).__name__)
    return content


def load(section: str, kind: type[Config], path: Path = FILE) -> Config:
    """The section as an instance of the dataclass `kind`.

    Raises:
        BadInput: for an unknown or missing key or a value of the wrong type; the line names file, key, what was
            expected, what came, and the nearest known key.
    """
    from tasks.sections import check_names

    content = read(path)
    check_names(content, path)
    if section not in content:
        raise BadInput(f"{path}: {section}", "this section", "none", nearest(section, content))
    return build(kind, content[section], path, section)


def build(kind: type[Config], values: Any, path: Path | str, place: str) -> Config:
    """An instance of the dataclass `kind` from plain data; `place` is the key's path in the file."""
    if not isinstance(values, dict):
        raise BadInput(f"{path}: {place}", "keys and values", _said(values))
    hints = typing.get_type_hints(kind)
    known = {field.name: field for field in fields(kind) if field.init}  # type: ignore[arg-type]
    inside = f"{place}." if place else ""
    for key in values:
        if key not in known:
            expected = f"one of {', '.join(known)}" if len(known) <= 6 else "a known key"
            raise BadInput(f"{path}: {inside}{key}", expected, "an unknown key", nearest(str(key), known))
    made = {}
    for name, field in known.items():
        if name in values:
            made[name] = convert(hints[name], values[name], path, f"{inside}{name}")
        elif field.default is MISSING and field.default_factory is MISSING:
            raise BadInput(f"{path}: {inside}{name}", _type_name(hints[name]), "nothing", "Add the key.")
    try:
        return kind(**made)
    except (ValueError, TypeError) as error:
        raise BadInput(f"{path}: {place}", "values that fit together", str(error)) from None


def convert(kind: Any, value: Any, path: Path | str, place: str) -> Any:
    """`value` as the type `kind`: scalars, literals, optionals, tuples, lists, dicts, paths and dataclasses."""
    origin, args = get_origin(kind), get_args(kind)
    if kind is Any:
        return value
    if origin in (typing.Union, types.UnionType):
        return _one_of(args, value, path, place, kind)
    if origin is typing.Literal:
        if value in args:
            return value
    elif is_dataclass(kind):
        return build(kind, value, path, place)  # type: ignore[arg-type]
    elif origin in (tuple, list) and isinstance(value, list):
        inner = _element_types(origin, args, len(value))
        if inner is not None:
            made = [convert(t, v, path, f"{place}[{i}]") for i, (t, v) in enumerate(zip(inner, value, strict=True))]
            return tuple(made) if origin is tuple else made
    elif origin is dict and isinstance(value, dict):
        return {convert(args[0], k, path, place): convert(args[1], v, path, f"{place}.{k}") for k, v in value.items()}
    elif kind is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    elif kind is float and isinstance(value, str) and EXPONENT.fullmatch(value):
        return float(value)  # YAML 1.1 reads 1e-4 as text, YAML 1.2 (and DVC) as a number
    elif kind is Path and isinstance(value, str):
        return Path(value)
    elif isinstance(kind, type) and isinstance(value, kind) and isinstance(value, bool) == (kind is bool):
        return value
    raise BadInput(f"{path}: {place}", _type_name(kind), _said(value))


def _one_of(args: tuple[Any, ...], value: Any, path: Path | str, place: str, kind: Any) -> Any:
    if value is None and type(None) in args:
        return None
    for option in args:
        if option is type(None):
            continue
        try:
            return convert(option, value, path, place)
        except BadInput:
            if is_dataclass(option) and isinstance(value, dict):
                raise
    raise BadInput(f"{path}: {place}", _type_name(kind), _said(value))


def _element_types(origin: Any, args: tuple[Any, ...], length: int) -> list[Any] | None:
    """The type of each element; None where the number of elements does not fit."""
    if not args:
        return [Any] * length
    if origin is list or (len(args) == 2 and args[1] is Ellipsis):
        return [args[0]] * length
    return list(args) if len(args) == length else None


def nearest(key: str, known: typing.Iterable[str]) -> str:
    """A question that names the known key most like `key`; empty where none is."""
    near = difflib.get_close_matches(key, list(known), n=1, cutoff=0.5)
    return f"Did you mean {near[0]}?" if near else ""


def _said(value: Any) -> str:
    return f"{value!r} ({type(value).__name__})"


def _type_name(kind: Any) -> str:
    origin, args = get_origin(kind), get_args(kind)
    if origin is typing.Literal:
        return "one of " + ", ".join(map(str, args))
    if origin in (typing.Union, types.UnionType):
        return " or ".join("nothing" if a is type(None) else _type_name(a) for a in args)
    if origin is tuple and args and args[-1] is not Ellipsis:
        return f"a list of {len(args)} values"
    if origin in (tuple, list):
        return f"a list of {_type_name(args[0])} values" if args else "a list"
    if is_dataclass(kind):
        return "keys and values"
    names = {int: "a whole number", float: "a number", str: "text", bool: "true or false", Path: "a path"}
    return names.get(kind, getattr(kind, "__name__", str(kind)))
