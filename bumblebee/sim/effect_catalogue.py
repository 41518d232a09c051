"""The catalogue: which effects a model may lack, by the names of the diagnosis contract, and one effect as a value."""

import math
from dataclasses import dataclass

# MuJoCo's default dry friction creeps where a real joint sticks; a joint with `coulomb_friction` gets it stiff.
STICTION_SOLREF = (0.004, 1.0)
STICTION_SOLIMP = 0.99
# The solver needs this many iterations to hold several stuck joints and contacts at once.
STICTION_ITERATIONS = 20


@dataclass(frozen=True)
class Kind:
    """One id of the catalogue: what it sits on and its parameter."""

    on: str
    """"joint" or "body"."""
    parameter: str
    """Name of its parameter in `Effect.parameters`."""
    unit: str
    """Unit of the parameter; "" for a factor."""
    lower: float
    """Smallest value that is physical."""
    upper: float
    """Largest value that is sensible; infinite where only the data can tell."""


CATALOGUE: dict[str, Kind] = {
    "coulomb_friction": Kind("joint", "frictionloss", "N m", 0.0, math.inf),
    "viscous_friction": Kind("joint", "damping", "N m s/rad", 0.0, math.inf),
    "armature": Kind("joint", "armature", "kg m^2", 0.0, math.inf),
    "motor_strength": Kind("joint", "factor", "", 0.05, 5.0),
    "kp": Kind("joint", "factor", "", 0.05, 5.0),
    "kd": Kind("joint", "factor", "", 0.0, 20.0),
    "command_delay": Kind("joint", "delay", "s", 0.0, 0.1),
    "encoder_offset": Kind("joint", "offset", "rad", -1.0, 1.0),
    "link_mass": Kind("body", "mass", "kg", 1e-3, math.inf),
}


@dataclass(frozen=True)
class Effect:
    """One effect: catalogue id, the joints or bodies it sits on, parameters by name (absolute, SI units)."""

    effect: str
    where: tuple[str, ...]
    parameters: dict[str, float]

    def value(self) -> float:
        """The effect's only parameter."""
        return self.parameters[CATALOGUE[self.effect].parameter]


def single(effect: str, where: str, value: float) -> Effect:
    """The effect `effect` on the one joint or body `where`, its parameter at `value`."""
    return Effect(effect, (where,), {CATALOGUE[effect].parameter: float(value)})
