"""The catalogue: which effects a model may lack, by the names of the diagnosis contract, and one effect as a value.

Effects are found where they lie: a file of a room here, or a module that an installed package names under the entry
point group `bumblebee.effects`, as `NAME = package.NAME`.
"""

import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import entry_points
from types import ModuleType

from bumblebee import effects
from bumblebee.effects.kind import Kind
from bumblebee.errors import BadInput

ENTRY_POINTS = "bumblebee.effects"


def _modules() -> Iterator[ModuleType]:
    """Modules of effects: those of the rooms, and those of other packages."""
    for found in pkgutil.walk_packages(effects.__path__, f"{effects.__name__}."):
        if not found.ispkg and found.name.count(".") == _DEPTH:
            yield import_module(found.name)
    for point in entry_points(group=ENTRY_POINTS):
        try:
            yield import_module(point.module)
        except ImportError as error:
            package = point.dist.name if point.dist else "an installed package"
            do = f"Mend the package, or uninstall it: pip uninstall {package}"
            raise BadInput(f"{package}: effect {point.name}", "a module that can be imported", str(error), do) from None


_DEPTH = 3  # dots of bumblebee.effects.ROOM.NAME


def _kinds(module: ModuleType) -> Iterator[Kind]:
    """Effects that a module defines."""
    for value in vars(module).values():
        if isinstance(value, type) and issubclass(value, Kind) and value.__module__ == module.__name__:
            yield _whole(value(), module)


def _whole(kind: Kind, module: ModuleType) -> Kind:
    """An effect that has all that is asked of each.

    Raises:
        TypeError: if one was forgotten.
    """
    forgotten = {
        "what it is, at the head of the file, and its law, in the class": module.__doc__ and type(kind).__doc__,
        "write: in place what add does to a spec": kind.added == kind.has("write"),
        "add, for it says native": kind.added or not kind.native,
        "hook, or torque_at": kind.hooks == (not kind.native or bool(kind.hooked)),
        "absent, or declared": (kind.absent is None) == kind.has("declared"),
        "law: its law in terms, or why there is none": kind.law,
        "undo: how the drive undoes it, or not_undone: why not": bool(kind.not_undone) != kind.has("undo"),
    }
    if missing := [what for what, there in forgotten.items() if not there]:
        raise TypeError(f"{module.__file__}: {'; '.join(missing)}")
    return kind


def _found() -> dict[str, Kind]:
    kinds = sorted((kind for module in _modules() for kind in _kinds(module)), key=lambda kind: (kind.rank, kind.id))
    if len(by_name := {kind.id: kind for kind in kinds}) < len(kinds):
        names = [kind.id for kind in kinds]
        raise TypeError(f"effects: {next(name for name in names if names.count(name) > 1)} stands in two files")
    return by_name


CATALOGUE: dict[str, Kind] = _found()


@dataclass(frozen=True)
class Effect:
    """One effect: catalogue id, the joints, bodies or geoms it sits on, parameters by name (absolute, SI units)."""

    effect: str
    where: tuple[str, ...]
    parameters: dict[str, float] = field(default_factory=dict)

    def value(self) -> float:
        """The effect's first parameter."""
        return self.parameters[CATALOGUE[self.effect].parameters[0].name]

    def values(self) -> tuple[float, ...]:
        """All its parameters, in the catalogue's order; those that are not given at their defaults."""
        given = self.parameters
        return tuple(
            given[p.name] if p.default is None else given.get(p.name, p.default)
            for p in CATALOGUE[self.effect].parameters
        )


def is_native(effect: Effect) -> bool:
    """Whether plain MJCF carries an effect, in the form that it has."""
    kind = CATALOGUE[effect.effect]
    return kind.native and not effect.parameters.get(kind.hooked, 0.0)


def single(effect: str, where: str, *values: float) -> Effect:
    """The effect `effect` on the one place `where` ("" for the whole robot), its parameters at `values` in order.

    Last parameters that have defaults may be left out; one at its default is not written into the effect.
    """
    kinds = CATALOGUE[effect].parameters
    if not sum(p.default is None for p in kinds) <= len(values) <= len(kinds):
        raise ValueError(f"{effect} has the parameters {CATALOGUE[effect].names}, got {len(values)} values")
    given = {p.name: float(v) for p, v in zip(kinds, values, strict=False) if p.default is None or v != p.default}
    return Effect(effect, (where,) if where else (), given)
