"""The catalogue: which effects a model may lack, by the names of the diagnosis contract, and one effect as a value."""

import math
from dataclasses import dataclass, field

from bumblebee.sim.effects.native import NO_SURFACE
from bumblebee.sim.effects.setpoints import NO_SPEED_LIMIT
from bumblebee.sim.units import is_known

# MuJoCo's default dry friction creeps where a real joint sticks; a joint with `coulomb_friction` gets it stiff.
STICTION_SOLREF = (0.004, 1.0)
STICTION_SOLIMP = 0.99
# The solver needs this many iterations to hold several stuck joints and contacts at once.
STICTION_ITERATIONS = 20


@dataclass(frozen=True)
class Parameter:
    """One number of an effect."""

    name: str
    unit: str
    """"" for a factor or a share."""
    lower: float
    """Smallest value that is physical."""
    upper: float
    """Largest value that is sensible; infinite where only the data can tell."""
    default: float | None = None
    """Its value where an effect does not give it, and then not written either; None: it must be given."""
    choice: bool = False
    """Whether it is 0 or 1 and names a form of the effect, not a size: never fitted."""
    matters: float = 0.0
    """A change of it that matters wherever it shapes the effect; 0: that depends on the data."""


@dataclass(frozen=True)
class Kind:
    """One id of the catalogue: what it sits on and its parameters."""

    on: str
    """"joint", "body", "geom" or "whole"."""
    parameters: tuple[Parameter, ...]
    """In the order of their arrays; at least one."""
    whole: bool = False
    """Whether `where: []` means all joints at once."""
    native: bool = True
    """Whether plain MJCF carries it; else (or in part) a runtime hook does."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its parameters."""
        return tuple(p.name for p in self.parameters)

    @property
    def parameter(self) -> str:
        """Name of its first parameter."""
        return self.parameters[0].name

    @property
    def unit(self) -> str:
        """Unit of its first parameter."""
        return self.parameters[0].unit

    @property
    def lower(self) -> float:
        """Smallest physical value of its first parameter."""
        return self.parameters[0].lower

    @property
    def upper(self) -> float:
        """Largest sensible value of its first parameter."""
        return self.parameters[0].upper


def _joint(
    *parameters: tuple[str, str, float, float, *tuple[float | bool, ...]], whole: bool = False, native: bool = True
) -> Kind:
    return Kind("joint", tuple(Parameter(*p) for p in parameters), whole, native)


def _body(*parameters: tuple[str, str, float, float, *tuple[float | bool, ...]], native: bool = True) -> Kind:
    return Kind("body", tuple(Parameter(*p) for p in parameters), False, native)


_INF = math.inf
_AXES = ("x", "y", "z")

CATALOGUE: dict[str, Kind] = {
    "coulomb_friction": _joint(("frictionloss", "N m", 0.0, _INF)),
    "viscous_friction": _joint(("damping", "N m s/rad", 0.0, _INF)),
    "quadratic_friction": _joint(("coefficient", "N m s^2/rad^2", 0.0, _INF)),
    "stribeck_friction": _joint(("stiction", "N m", 0.0, _INF), ("velocity", "rad/s", 1e-3, 100.0), native=False),
    # The coefficient is the mean of both directions, the difference that of forward and backward motion.
    "load_dependent_friction": _joint(("coefficient", "", 0.0, 2.0), ("difference", "", -4.0, 4.0, 0.0), native=False),
    "armature": _joint(("armature", "kg m^2", 0.0, _INF)),
    "motor_strength": _joint(("factor", "", 1e-3, 20.0)),
    "kp": _joint(("factor", "", 1e-3, 20.0)),
    "kd": _joint(("factor", "", 0.0, 50.0)),
    "torque_limit": _joint(("limit", "N m", 1e-3, _INF)),
    "torque_speed_limit": _joint(("speed", "rad/s", 0.05, _INF), native=False),
    "command_delay": _joint(("delay", "s", 0.0, 0.1), whole=True),
    # What the drive makes of its targets; of a profile without a limit of speed the acceleration alone is given.
    "command_filter": _joint(("time", "s", 0.0, 0.5), whole=True, native=False),
    "command_rate_limit": _joint(("rate", "rad/s", 1e-3, _INF), native=False),
    "command_profile": _joint(
        ("acceleration", "rad/s^2", 1e-2, _INF), ("speed", "rad/s", 1e-3, NO_SPEED_LIMIT, NO_SPEED_LIMIT), native=False
    ),
    "torque_lag": _joint(("time", "s", 0.0, 0.1), whole=True, native=False),
    "encoder_delay": _joint(("delay", "s", 0.0, 0.05), whole=True, native=False),
    "dropped_commands": _joint(("share", "", 0.0, 0.9), whole=True, native=False),
    "encoder_offset": _joint(("offset", "rad", -1.0, 1.0), native=False),
    "imu_offset": _body(("roll", "rad", -0.5, 0.5), ("pitch", "rad", -0.5, 0.5), native=False),
    "encoder_quantisation": _joint(("step", "rad", 0.0, 0.2), native=False),
    "joint_spring": _joint(("stiffness", "N m/rad", -_INF, _INF), ("preload", "N m", -_INF, _INF)),
    "asymmetric_friction": _joint(("difference", "N m", -_INF, _INF)),
    # dahl 0: a spring that yields at the width; 1: Dahl's law, which turns round smoothly and needs a hook.
    "hysteresis": _joint(
        ("amplitude", "N m", 0.0, _INF), ("width", "rad", 1e-5, 3.0), ("dahl", "", 0.0, 1.0, 0.0, True)
    ),
    "cogging": _joint(
        ("sine", "N m", -_INF, _INF), ("cosine", "N m", -_INF, _INF), ("periods", "1/turn", 0.1, 2000.0), native=False
    ),
    # encoder 0: it reads the motor; 1: it reads the joint, behind the play or the shaft, which needs a hook.
    "backlash": _joint(("gap", "rad", 0.0, 0.5), ("encoder", "", 0.0, 1.0, 0.0, True)),
    # loss: damping of a shaft over its stiffness; share: of the joint's armature that turns with the link.
    "series_elasticity": _joint(
        ("stiffness", "N m/rad", 1e-2, _INF),
        ("encoder", "", 0.0, 1.0, 0.0, True),
        ("loss", "s", 0.0, 0.1, 1e-3),
        ("share", "", 0.0, 0.5, 0.0, False, 0.1),
    ),
    # spread 0: what is added sits at the centre of mass; 1: the moments of inertia grow as the mass does.
    "link_mass": _body(("mass", "kg", 1e-3, _INF), ("spread", "", 0.0, 1.0, 0.0)),
    "link_com": _body(*((axis, "m", -2.0, 2.0) for axis in _AXES)),
    "link_inertia": _body(*((axis + axis, "kg m^2", 1e-9, _INF) for axis in _AXES)),
    "ground_friction": Kind("geom", (Parameter("friction", "", 0.0, 5.0),)),
    "ground_compliance": Kind("geom", (Parameter("time", "s", 2e-3, 0.5),)),
    # The turn about the world's axes that takes the declared gravity to the true one; with gravity along z, z is 0.
    "ground_slope": Kind(
        "whole", (*(Parameter(axis, "rad", -0.5, 0.5) for axis in ("x", "y")), Parameter("z", "rad", -0.5, 0.5, 0.0))
    ),
    # A level surface that the model lacks, and the point of the body, in its frame, that touches it.
    "surface_contact": _body(
        ("height", "m", NO_SURFACE, 10.0),
        *((axis, "m", -2.0, 2.0) for axis in _AXES),
        ("friction", "", 0.0, 5.0, 1.0, False, 0.1),
    ),
    "thermal_fade": _joint(("rate", "1/s", -1.0, 1.0), native=False),
    "strength_drift": _joint(("rate", "1/s", -1.0, 1.0), native=False),
    "external_wrench": _body(
        *((f"f{axis}", "N", -_INF, _INF) for axis in _AXES),
        *((f"t{axis}", "N m", -_INF, _INF) for axis in _AXES),
        native=False,
    ),
    # Its parameters are terms of `sim.effects.terms` and their coefficients, not names of this catalogue.
    "discovered": Kind("joint", (), native=False),
}
if unlike := {
    p.unit for kind in CATALOGUE.values() if kind.on == "joint" for p in kind.parameters if not is_known(p.unit)
}:
    raise TypeError(f"bumblebee/sim/units.py: say what {sorted(unlike)} is on a slide")


@dataclass(frozen=True)
class Effect:
    """One effect: catalogue id, the joints, bodies or geoms it sits on, parameters by name (absolute, SI units)."""

    effect: str
    where: tuple[str, ...]
    parameters: dict[str, float] = field(default_factory=dict)

    def value(self) -> float:
        """The effect's first parameter."""
        return self.parameters[CATALOGUE[self.effect].parameter]

    def values(self) -> tuple[float, ...]:
        """All its parameters, in the catalogue's order; those that are not given at their defaults."""
        given = self.parameters
        return tuple(
            given[p.name] if p.default is None else given.get(p.name, p.default)
            for p in CATALOGUE[self.effect].parameters
        )


# Forms of effects that MJCF carries in their plain form only: a parameter that is not zero.
HOOKED = {"hysteresis": "dahl", "backlash": "encoder", "series_elasticity": "encoder"}


def is_native(effect: Effect) -> bool:
    """Whether plain MJCF carries an effect, in the form that it has."""
    return CATALOGUE[effect.effect].native and not effect.parameters.get(HOOKED.get(effect.effect, ""), 0.0)


def single(effect: str, where: str, *values: float) -> Effect:
    """The effect `effect` on the one place `where` ("" for the whole robot), its parameters at `values` in order.

    Last parameters that have defaults may be left out; one at its default is not written into the effect.
    """
    kinds = CATALOGUE[effect].parameters
    if not sum(p.default is None for p in kinds) <= len(values) <= len(kinds):
        raise ValueError(f"{effect} has the parameters {CATALOGUE[effect].names}, got {len(values)} values")
    given = {p.name: float(v) for p, v in zip(kinds, values, strict=False) if p.default is None or v != p.default}
    return Effect(effect, (where,) if where else (), given)
