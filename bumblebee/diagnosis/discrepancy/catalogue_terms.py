"""A discovered effect as a candidate: terms on a joint whose coefficients are fitted like any effect's parameters."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, Formula
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.simulation import Plant, declared_values
from bumblebee.diagnosis.thresholds.discrepancy import CatalogueTerms
from bumblebee.effects.law import Law
from bumblebee.sim.effects import CATALOGUE, read_term
from bumblebee.sim.servo import servos_of

_NAMES = {"u": "target", "tau": "torque", "t": "time", "q": "position", "v": "velocity"}


def stiffer_than_the_drive(plant: Plant, own: Formula, values: np.ndarray, rule: CatalogueTerms) -> bool:
    """Whether a term that acts on the target asks for more than `rule.stiff` times the servo's own gain."""
    servo = servos_of(plant.model, [int(plant.model.joint(own.where).id)])
    gain = float(abs(servo.bias[0, 1]))
    acts = [abs(v) for text, v in zip(own.texts, values, strict=True) if read_term(text).drives]
    return bool(gain > 0 and acts and max(acts) > rule.stiff * gain)


def in_terms(plant: Plant, fit: Fit, candidate: Candidate) -> dict[str, float]:
    """Terms that are the same torque as a chosen effect of the catalogue; {} where the language has none."""
    law = CATALOGUE[candidate.effect].law
    if not isinstance(law, Law) or law.terms is None:
        return {}
    found = law.terms(fit.of(candidate), np.array(declared_values(plant, candidate.effect, candidate.where)))
    return {text: float(value) for text, value in found.items()}


def quantities_of(texts: Sequence[str]) -> tuple[str, ...]:
    """Quantities that terms depend on: of `effects.law.QUANTITIES`, and "another joint (NAME)"."""
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
    law = CATALOGUE[effect].law if effect in CATALOGUE else ""
    return isinstance(law, Law) and law.family in kinds
