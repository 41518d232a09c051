"""The sealed file: reads it, and makes laws of its effects.

Independent of `bumblebee.sim.effects` on purpose: what the diagnosis finds must not share code with what it looks for.
"""

import hashlib
import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.robot.model import build_spec
from bumblebee.stand_in.undeclared.declared import Declared, describe
from bumblebee.stand_in.undeclared.faults import largest
from bumblebee.stand_in.undeclared.kinds import KINDS, Kind, Place, fits, places
from bumblebee.stand_in.undeclared.law import Law

SCHEMA = 2
_AGAIN = "Run the stage seal again."
_DRAWN = {"sign": int, "axis": int, "number": int, "other": str}
_PEAKS = ("peak_torque", "peak_speed", "peak_rate")

Json = dict[str, Any]


@cache
def declared_g1() -> Declared:
    """The G1 as its maker describes it."""
    return describe("g1", build_spec())


def read_sealed(path: Path) -> list[Json]:
    """The effects in a sealed file; another schema, or a seal (sha256 of the effects) that is broken, is refused."""
    try:
        sealed = json.loads(Path(path).read_text())
        schema, effects, claimed = sealed.get("schema"), sealed["effects"], sealed["sha256"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise BadInput(path, "a sealed robot with effects and sha256", f"{type(error).__name__}: {error}") from None
    if schema != SCHEMA:
        raise BadInput(f"{path}: field schema", str(SCHEMA), str(schema)[:12], _AGAIN)
    if seal(effects) != claimed:
        raise BadInput(
            f"{path}: field sha256",
            seal(effects)[:12],
            str(claimed)[:12],
            f"The file was changed. {_AGAIN}",
        )
    to_laws(effects, path)
    return effects


def seal(effects: list[Json]) -> str:
    """sha256 of the effects as canonical JSON."""
    return hashlib.sha256(json.dumps(effects, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def entry(kind: Kind, place: Place, size: float) -> Json:
    """One effect as it stands in the file: what it is in the contract's words, and what its law is made of."""
    _, parameters = kind.make(place, size)
    _, neutral = kind.make(place, max(kind.least(place), 1e-9 * kind.first(place)))
    changed = sorted(parameters, key=lambda name: bool(np.isclose(parameters[name], neutral[name])))
    return {
        "effect": kind.name,
        "where": [place.name] if place.name else [],
        "parameters": {name: float(parameters[name]) for name in changed},  # those that the size changes come first
        "unit": kind.unit,
        "size": float(size),
        "draw": {**place.draw, **{name: getattr(place, name) for name in _PEAKS}},
    }


def to_laws(effects: Sequence[Json], where: object = "effects") -> list[Law]:
    """The laws of a robot with these effects."""
    if not isinstance(effects, list):
        raise BadInput(f"{where}: effects", "a list", type(effects).__name__)
    return [_law(effect, f"{where}: effects[{index}]") for index, effect in enumerate(effects)]


def _law(effect: Json, where: str) -> Law:
    name = effect.get("effect") if isinstance(effect, dict) else None
    kind = KINDS.get(name) if isinstance(name, str) else None
    if kind is None or not fits(kind, "g1"):
        raise BadInput(where, "a kind of effect that a G1 can have", str(name)[:40])
    place = _place(effect, kind, where)
    size, least, most = effect.get("size"), kind.least(place), largest(kind, place)
    if not _number(size) or not least <= size <= most * (1 + 1e-9) or size <= 0:
        raise BadInput(f"{where}: {name}: size", f"a number above {least:g}, at most {most:g}", str(size)[:40])
    law, parameters = kind.make(place, float(size))
    told = effect.get("parameters")
    if not _same(told, parameters):
        raise BadInput(
            f"{where}: {name}: parameters",
            f"those of its size, {parameters}",
            str(told)[:60],
            "Run the stage seal again.",
        )
    return law


def _same(told: object, parameters: dict[str, float]) -> bool:
    if not isinstance(told, dict) or told.keys() != parameters.keys() or not all(map(_number, told.values())):
        return False
    return all(np.isclose(told[key], parameters[key], rtol=1e-6, atol=1e-12) for key in parameters)


def _place(effect: Json, kind: Kind, where: str) -> Place:
    """Where it sits, and what was drawn there."""
    robot, names, drawn = declared_g1(), effect.get("where"), effect.get("draw")
    allowed = places(kind, robot)
    name = names[0] if isinstance(names, list) and len(names) == 1 else "" if names == [] else None
    if name not in allowed:
        words = f"one {kind.on} of the model" if any(allowed) else "nothing"
        raise BadInput(f"{where}: {kind.name}: where", words, str(names)[:60])
    if not isinstance(drawn, dict) or not _drawn(drawn, robot):
        words = f"sign, axis, number, other and {', '.join(_PEAKS)}"
        raise BadInput(f"{where}: {kind.name}: draw", words, str(drawn)[:60])
    return Place(robot, name, {key: drawn[key] for key in _DRAWN}, *(float(drawn[key]) for key in _PEAKS))


def _drawn(drawn: Json, robot: Declared) -> bool:
    """Whether a draw is one: the side, axis, harmonic and other joint, and what the declared robot does there."""
    whole = all(isinstance(drawn.get(key), of) for key, of in _DRAWN.items())
    if not whole or not all(_number(drawn.get(key)) and drawn[key] >= 0 for key in _PEAKS):
        return False
    return drawn["sign"] in (-1, 1) and 0 <= drawn["axis"] <= 2 and drawn["other"] in robot.joints


def _number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and -1e9 < value < 1e9
