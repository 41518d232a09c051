"""Effects of the catalogue in the language of `sim.effects.terms`: one row each, or why there is none."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from bumblebee.diagnosis.discrepancy.regressors import Quantities
from bumblebee.sim.effects import CATALOGUE

QUANTITIES = ("position", "velocity", "target", "torque", "time", "history")
_POSITION, _VELOCITY, _TARGET, _TORQUE, _TIME, _ = ((name,) for name in QUANTITIES)
Rows = Iterator[tuple[Any, ...]]
"""Rows of basis functions: texts, quantities, cost; of one with an inner number also that, its family and its reach."""


@dataclass(frozen=True)
class Law:
    """One effect in terms."""

    rows: Callable[[Quantities, int], Rows]
    """Rows of the law on a joint (an index)."""
    family: Literal["", "friction(", "q", "v"]
    """Terms of its constant part, linear part or first harmonic; "": it stays beside every discovered effect."""
    terms: Callable[[np.ndarray, np.ndarray], dict[str, float]] | None = None
    """(its parameters, the declared ones) -> the same torque as terms, for the effects that have a family."""
    driven: bool = False
    """Whether only a joint whose drive gives a torque can have it."""


def waves(frame: str) -> Callable[[float], tuple[str, ...]]:
    """Texts of a harmonic of the position, by its number."""
    return lambda n: tuple(frame.format(f"{f}({n:.4g}*q)") for f in ("sin", "cos"))


def _fixed(*rows: tuple[Any, ...]) -> Callable[[Quantities, int], Rows]:
    return lambda data, j: iter(rows)


def _stribeck(data: Quantities, j: int) -> Rows:
    speed = float(np.sqrt((data.v[..., j] ** 2).mean())) + 1e-9
    for share in data.thresholds.term_library.stribeck_speeds:
        yield (f"friction(exp(-(v/{share * speed:.3g})^2))",), _VELOCITY, 2


def _cogging(data: Quantities, j: int) -> Rows:
    rule, travel = data.thresholds.term_library, float(np.ptp(data.q[..., j]))
    for n in rule.cogging_harmonics:
        if n * travel > rule.cogging_travel * np.pi:
            yield waves("{}")(n), _POSITION, 2, float(n), waves("{}"), rule.harmonic_reach / travel


def _limits(data: Quantities, j: int) -> Rows:
    for share in data.thresholds.term_library.saturation_quantiles:
        edge = f"{np.quantile(np.abs(data.tau[..., j]), share):.4g}"
        yield (f"relu(tau - {edge}) - relu(-tau - {edge})",), _TORQUE, 2


LAWS: dict[str, Law] = {
    "coulomb_friction": Law(
        _fixed((("friction(1)",), _VELOCITY, 1)), "friction(", lambda now, was: {"friction(1)": now[0] - was[0]}
    ),
    "viscous_friction": Law(_fixed((("v",), _VELOCITY, 1)), "v", lambda now, was: {"v": -(now[0] - was[0])}),
    "quadratic_friction": Law(
        _fixed((("v*abs(v)",), _VELOCITY, 2)), "v", lambda now, was: {"v*abs(v)": -(now[0] - was[0])}
    ),
    "joint_spring": Law(
        _fixed((("1",), (), 1), (("q", "1"), _POSITION, 1)),
        "q",
        lambda now, was: {"q": -(now[0] - was[0]), "1": now[1] - was[1]},
    ),
    "strength_drift": Law(_fixed((("t*tau",), _TIME, 2)), ""),
    "stribeck_friction": Law(_stribeck, "friction(", lambda now, was: {f"friction(exp(-(v/{now[1]:.3g})^2))": now[0]}),
    "cogging": Law(_cogging, "q", lambda now, was: dict(zip(waves("{}")(now[2]), now[:2], strict=True))),
    "motor_strength": Law(_fixed((("tau",), _TORQUE, 1)), "", driven=True),
    "kp": Law(_fixed((("u - q",), _TARGET, 1)), "", driven=True),
    "load_dependent_friction": Law(
        _fixed((("friction(abs(tau))",), _TORQUE, 2)),
        "friction(",
        lambda now, was: {"friction(abs(tau))": now[0]},
        driven=True,
    ),
    "torque_limit": Law(_limits, "", driven=True),
}
_JOINTS = "terms are those of one joint"
NO_LAW = {
    "armature": "no term has the acceleration",
    "kd": "its torque is that of v, which is called viscous_friction",
    "torque_speed_limit": "no term is a limit that moves with the speed",
    "command_delay": "no term has an older target",
    "command_filter": "no term has a filtered target",
    "command_rate_limit": "its rate moves the target once a command, which is called slewed(r, T) - u",
    "command_profile": "no term has a target of limited acceleration",
    "torque_lag": "no term has an older torque",
    "encoder_delay": "no term has an older reading",
    "dropped_commands": "which commands were lost is not in a log",
    "encoder_offset": "it is in the readings",
    "imu_offset": "it is in the readings",
    "encoder_quantisation": "it is in the readings",
    "asymmetric_friction": "its torque is that of 1, which is called joint_spring",
    "hysteresis": "no term remembers a path",
    "backlash": "it changes the structure",
    "series_elasticity": "it changes the structure",
    "link_mass": _JOINTS,
    "link_com": _JOINTS,
    "link_inertia": _JOINTS,
    "ground_friction": _JOINTS,
    "ground_compliance": _JOINTS,
    "ground_slope": _JOINTS,
    "surface_contact": "where it acts depends on all joints",
    "thermal_fade": "no term has the motor's heat",
    "external_wrench": _JOINTS,
    "discovered": "it is made of terms",
}
"""Effects without a law in terms, each with the reason."""
if unlike := CATALOGUE.keys() ^ (LAWS.keys() | NO_LAW.keys()):
    where = "bumblebee/diagnosis/discrepancy/catalogue_laws.py"
    raise TypeError(f"{where}: each effect needs a row in LAWS, or a reason in NO_LAW; not so: {sorted(unlike)}")
