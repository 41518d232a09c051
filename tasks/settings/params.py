"""The sections of params.yaml, each as the frozen dataclass of its stage: every key known, present and of its type."""

import difflib
import math
import re
import types
import typing
from collections.abc import Iterable
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from bumblebee.ranges import Unfit, annotations, describe, element_kinds, fault, shown

FILE = Path("params.yaml")
# Which dataclass each section is, by module and name: the module is imported by whoever checks the whole file.
SECTIONS = {
    "seal": "tasks.seal:SealConfig",
    "motions": "tasks.motions:MotionsConfig",
    "filter": "tasks.filter:FilterStageConfig",
    "cluster": "bumblebee.clustering.config:ClusterConfig",
    "base": "tasks.base:BaseConfig",
    "experts": "tasks.experts:ExpertsConfig",
    "rollouts": "tasks.settings.rollouts_config:RolloutsConfig",
    "ingest": "tasks.ingest:IngestConfig",
    "gate": "tasks.approvals.gate:GateConfig",
    "diagnose": "tasks.diagnose:DiagnoseConfig",
    "compensate": "tasks.compensate:CompensateConfig",
    "delta": "bumblebee.learning.delta:DeltaConfig",
    "refine": "tasks.refine:RefineConfig",
    "control": "tasks.settings.control_config:ControlConfig",
    "distill": "bumblebee.learning.generalist.distill:DistillConfig",
    "evaluate": "tasks.evaluate:EvaluateConfig",
    "publish": "tasks.publish:PublishConfig",
    "report": "tasks.report:ReportConfig",
}
LOOP = ("clusters", "rounds", "final_round")
EXPONENT = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?e[-+]?[0-9]+", re.IGNORECASE)
Config = TypeVar("Config")


def read(path: Path = FILE) -> dict[str, Any]:
    """The whole of params.yaml as plain data.

    Raises:
        BadInput: when the file is missing, damaged, or is not a YAML mapping of distinct keys.
    """
    if not path.exists():
        raise BadInput(path, "a file with the parameters", "no file", "Run in the folder that holds it.")
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise BadInput(path, "sections of parameters", type(content).__name__)
    return content


def load(section: str, kind: type[Config], path: Path = FILE) -> Config:
    """The section as an instance of the dataclass `kind`.

    Raises:
        BadInput: for an unknown or missing key or a value of the wrong type; the line names file, key, what was
            expected, what came, and the nearest known key.
    """
    content = read(path)
    check_names(content, path)
    return section_of(content, section, kind, path)


def check_names(content: Iterable[str], path: Path) -> None:
    """Refuse a key at the top of the file that nothing reads.

    Raises:
        BadInput: naming it and the known key most like it.
    """
    known = [*LOOP, *SECTIONS]
    for section in content:
        if section not in known:
            said = shown(section, bare=True)
            raise BadInput(f"{path}: {said}", "a known section", "an unknown one", nearest(said, known))


def section_of(content: dict[str, Any], section: str, kind: type[Config], path: Path) -> Config:
    """Section from the content of the file."""
    if section not in content:
        raise BadInput(f"{path}: {section}", "this section", "none", nearest(section, content))
    return build(kind, content[section], path, section)


def build(kind: type[Config], values: Any, path: Path | str, place: str) -> Config:
    """An instance of the dataclass `kind` from plain data; `place` is the key's path in the file."""
    if not isinstance(values, dict):
        raise BadInput(f"{path}: {place}", "keys and values", _said(values))
    hints = annotations(kind)
    known = {field.name: field for field in fields(kind) if field.init}  # type: ignore[arg-type]
    inside = f"{place}." if place else ""
    for key in values:
        if key not in known:
            expected = f"one of {', '.join(known)}" if len(known) <= 6 else "a known key"
            said = shown(key, bare=True)
            raise BadInput(f"{path}: {inside}{said}", expected, "an unknown key", nearest(said, known))
    made = {}
    for name, field in known.items():
        if name in values:
            made[name] = convert(hints[name], values[name], path, f"{inside}{name}")
        elif field.default is MISSING and field.default_factory is MISSING:
            raise BadInput(f"{path}: {inside}{name}", describe(hints[name]), "nothing", "Add the key.")
    try:
        return kind(**made)
    except Unfit as error:
        raise BadInput(f"{path}: {inside}{error.field}", error.expected, error.came) from None
    except (ValueError, TypeError) as error:
        raise BadInput(f"{path}: {place}", "values that fit together", str(error)) from None


def convert(kind: Any, value: Any, path: Path | str, place: str) -> Any:
    """`value` as the type `kind`: scalars, literals, optionals, tuples, lists, dicts, paths and dataclasses."""
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _ranged(kind, args, value, path, place)
    if kind is Any:
        return value
    if origin in (typing.Union, types.UnionType):
        return _one_of(args, value, path, place, kind)
    if is_dataclass(kind):
        return build(kind, value, path, place)  # type: ignore[arg-type]
    if origin in (tuple, list) and isinstance(value, list):
        inner = element_kinds(origin, args, len(value))
        if inner is not None:
            made = [convert(t, v, path, f"{place}[{i}]") for i, (t, v) in enumerate(zip(inner, value, strict=True))]
            return tuple(made) if origin is tuple else made
    elif origin is dict and isinstance(value, dict):
        keys = {key: f"{place}.{shown(key, bare=True)}" for key in value}
        return {convert(args[0], k, path, keys[k]): convert(args[1], v, path, keys[k]) for k, v in value.items()}
    elif kind is float and isinstance(value, str) and EXPONENT.fullmatch(value):
        return float(value)  # YAML 1.1 reads 1e-4 and 1.5e4 as text, YAML 1.2 (and DVC) as numbers
    elif fault(kind, value, place) is None:
        return _made(kind, value)
    raise BadInput(f"{path}: {place}", describe(kind), _said(value))


def _ranged(kind: Any, args: tuple[Any, ...], value: Any, path: Path | str, place: str) -> Any:
    """A value with a range; what was expected names it."""
    try:
        made = convert(args[0], value, path, place)
    except BadInput as error:
        if error.where != f"{path}: {place}":
            raise
        raise BadInput(error.where, describe(kind), _said(value)) from None
    if fault(kind, str(value) if args[0] is Path else made, place) is not None:
        raise BadInput(f"{path}: {place}", describe(kind), _said(value))
    return made


def _made(kind: Any, value: Any) -> Any:
    """A value of the right type in it; a whole number too large for a float is as bad as infinite."""
    if kind is float:
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return Path(value) if kind is Path else value


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
    raise BadInput(f"{path}: {place}", describe(kind), _said(value))


def nearest(key: str, known: Iterable[str]) -> str:
    """A question that names the known key most like `key`; empty where none is."""
    near = difflib.get_close_matches(key, list(known), n=1, cutoff=0.5)
    return f"Did you mean {near[0]}?" if near else ""


def _said(value: Any) -> str:
    return f"{shown(value)} ({type(value).__name__})"
