"""The oracle: the truth's own parameters in the declared model, where the simulator's effects have a name for them."""

from collections.abc import Sequence
from typing import Any

from benchmarks.undeclared.rivals.common import Answer, error_of
from bumblebee.effects.kind import Kind
from bumblebee.sim.effects import CATALOGUE, Effect
from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.kinds import KINDS


def run(robot: Declared, truth: Sequence[dict[str, Any]]) -> Answer | None:
    """None where an effect has no counterpart with the same parameters."""
    effects: list[Effect] = []
    for entry in truth:
        name = entry["effect"]
        kind = CATALOGUE.get(name)
        if kind is None or KINDS[name].outside or not set(_names(kind)) <= set(entry["parameters"]):
            return None
        where = ("floor",) if name in ("ground_friction", "ground_compliance") else tuple(entry["where"])
        effects.append(Effect(name, where, {n: entry["parameters"][n] for n in _names(kind)}))
        if name in _COULOMB:
            level = _COULOMB[name] * abs(entry["parameters"][_names(kind)[0]])
            effects.append(Effect("coulomb_friction", where, {"frictionloss": level}))
    return Answer([{"effect": e.effect, "where": list(e.where)} for e in effects], error_of(effects))


# Dry friction at speed beside Stribeck's breakaway, and mean of an asymmetric one, as shares of the parameter.
_COULOMB = {"stribeck_friction": 0.4 / 0.6, "asymmetric_friction": 0.625 / 0.75}


def _names(kind: Kind) -> tuple[str, ...]:
    return tuple(parameter.name for parameter in kind.parameters)
