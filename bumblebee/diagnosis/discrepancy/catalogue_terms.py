"""A discovered effect as a candidate: terms on a joint whose coefficients are fitted like any effect's parameters."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, Formula
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.simulation import Plant, declared_values
from bumblebee.diagnosis.thresholds.discrepancy import CatalogueTerms
from bumblebee.sim.effects import read_term
from bumblebee.sim.servo import servos_of

# Effects of the catalogue of one family with a basis function: its constant part, linear part, first harmonic.
_FAMILY = {
    "friction(": ("coulomb_friction", "stribeck_friction", "load_dependent_friction"),
    "q": ("joint_spring", "cogging"),
    "v": ("viscous_friction",),
}
_NAMES = {"u": "target", "tau": "torque", "t": "time", "q": "position", "v": "velocity"}


def stiffer_than_the_drive(plant: Plant, own: Formula, values: np.ndarray, rule: CatalogueTerms) -> bool:
    """Whether a term that acts on the target asks for more than `rule.stiff` times the servo's own gain."""
    servo = servos_of(plant.model, [int(plant.model.joint(own.where).id)])
    gain = float(abs(servo.bias[0, 1]))
    acts = [abs(v) for text, v in zip(own.texts, values, strict=True) if read_term(text).drives]
    return bool(gain > 0 and acts and max(acts) > rule.stiff * gain)


def in_terms(plant: Plant, fit: Fit, candidate: Candidate) -> dict[str, float]:
    """Terms that are the same torque as a chosen effect of the catalogue; {} where the language has none."""
    values, nominal = fit.of(candidate), declared_values(plant, candidate.effect, candidate.where)
    first = float(values[0] - nominal[0])
    if candidate.effect == "coulomb_friction":
        return {"friction(1)": first}
    if candidate.effect == "viscous_friction":
        return {"v": -first}
    if candidate.effect == "joint_spring":
        return {"q": -first, "1": float(values[1] - nominal[1])}
    if candidate.effect == "cogging":
        return {f"{f}({values[2]:.4g}*q)": float(x) for f, x in zip(("sin", "cos"), values[:2], strict=True)}
    if candidate.effect == "stribeck_friction":
        return {f"friction(exp(-(v/{values[1]:.3g})^2))": float(values[0])}
    if candidate.effect == "load_dependent_friction":
        return {"friction(abs(tau))": float(values[0])}
    return {}


def quantities_of(texts: Sequence[str]) -> tuple[str, ...]:
    """Quantities that terms depend on: of `term_library.QUANTITIES`, and "another joint (NAME)"."""
    found: list[str] = []
    for term in map(read_term, texts):
        found += [f"another joint ({other})" for other in term.others]
        found += [said for name, said in _NAMES.items() if name in term.names]
        found += ["history"] if term.states else []
    return tuple(dict.fromkeys(found))


def related(texts: Sequence[str], effect: str) -> bool:
    """Whether a catalogue effect is of the family of basis functions `texts`: of friction, position or velocity."""
    kinds = set()
    for text in texts:
        if text.startswith("friction("):
            kinds.add("friction(")
        elif "[" not in text and "u" not in text.replace("curve", "") and "t" not in text.replace("tanh", ""):
            kinds |= {name for name in ("q", "v") if name in text.replace("curve", "")}
    return any(effect in _FAMILY[kind] for kind in kinds)
