"""Parts that the rivals share: the usual parameters of a robot, a linear view of them, and how a fit names effects.

A method that moves every parameter names none by itself. Here an effect is named if taking it out alone gives back at
least a twentieth of what the whole fit gained, and nothing is named if the whole fit gained less than 1 %.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.undeclared.sight import error_of as residual_error
from bumblebee.diagnosis.residuals import Problem
from bumblebee.sim.effects import Effect
from bumblebee.stand_in.undeclared.declared import Declared

_SHARE, _LEAST = 0.05, 0.01


@dataclass(frozen=True)
class Parameter:
    """One number that a method may move."""

    effect: str
    where: tuple[str, ...]
    name: str
    nominal: float
    step: float
    low: float
    high: float

    def at(self, value: float) -> Effect:
        """The effect at `value`, inside its bounds."""
        return Effect(self.effect, self.where, {self.name: float(np.clip(value, self.low, self.high))})


@dataclass(frozen=True, eq=False)
class Answer:
    """Answer of a method."""

    named: list[dict]
    """Entries with effect and where, the most important first."""
    error: Callable[[Problem], float]
    """Error on other windows, by `sight.error_of`."""


def joint_parameters(robot: Declared, kinds: Sequence[str]) -> list[Parameter]:
    """The kinds of one number a joint, on every joint."""
    found = []
    for j, name in enumerate(robot.joints):
        table = {
            "coulomb_friction": ("frictionloss", robot.friction[j], 0.01 * robot.limit[j], 0.0, np.inf),
            "viscous_friction": ("damping", robot.damping[j], 0.03 * robot.kd[j], 0.0, np.inf),
            "armature": ("armature", robot.armature[j], 0.1 * robot.armature[j], 1e-6, np.inf),
            "motor_strength": ("factor", 1.0, -0.05, 0.05, 5.0),
            "command_delay": ("delay", 0.0, 0.003, 0.0, 0.08),
            "encoder_offset": ("offset", 0.0, 0.01, -0.5, 0.5),
        }
        found += [Parameter(kind, (name,), *map_row(table[kind])) for kind in kinds]
    return found


def map_row(row: tuple) -> tuple:
    """A row of plain numbers."""
    return (row[0], *(float(v) for v in row[1:]))


def every_parameter(robot: Declared) -> list[Parameter]:
    """The six joint kinds and the masses of all bodies of 0.1 kg and more."""
    kinds = ("coulomb_friction", "viscous_friction", "armature", "motor_strength", "command_delay", "encoder_offset")
    masses = [
        Parameter("link_mass", (b,), "mass", m, 0.1 * m, 0.05 * m, 20 * m) for b, m in robot.mass.items() if m >= 0.1
    ]
    return joint_parameters(robot, kinds) + masses


def effects_at(parameters: Sequence[Parameter], values: np.ndarray) -> list[Effect]:
    """Those that differ from the declared robot."""
    return [p.at(v) for p, v in zip(parameters, values, strict=True) if abs(v - p.nominal) > 1e-9 * abs(p.step)]


def residuals_of(problem: Problem, sets: Sequence[list[Effect]], group: int = 16) -> np.ndarray:
    """Whitened residuals (V, n), flat."""
    parts = [problem.residual(list(sets[i : i + group])) for i in range(0, len(sets), group)]
    return np.concatenate(parts).reshape(len(sets), -1)


def jacobian(problem: Problem, parameters: Sequence[Parameter], values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residual (n,) at `values` and its change per step of each parameter, (P, n)."""
    sets = [effects_at(parameters, values)]
    for i, p in enumerate(parameters):
        moved = values.copy()
        moved[i] += p.step
        sets.append(effects_at(parameters, moved))
    out = residuals_of(problem, sets)
    return out[0], out[1:] - out[0]


def clip(parameters: Sequence[Parameter], values: np.ndarray) -> np.ndarray:
    """Inside the bounds."""
    return np.clip(values, [p.low for p in parameters], [p.high for p in parameters])


def named(problem: Problem, parameters: Sequence[Parameter], values: np.ndarray) -> list[dict]:
    """Which effects a fit names, by what taking each out alone costs."""
    sets = [[], effects_at(parameters, values)]
    for i, p in enumerate(parameters):
        without = values.copy()
        without[i] = p.nominal
        sets.append(effects_at(parameters, without))
    power = (residuals_of(problem, sets) ** 2).mean(axis=1)
    gain = power[0] - power[1]
    if gain < _LEAST * power[0]:
        return []
    shares = (power[2:] - power[1]) / gain
    order = [i for i in np.argsort(-shares) if shares[i] >= _SHARE]
    return [{"effect": parameters[i].effect, "where": list(parameters[i].where)} for i in order]


def error_of(effects: Sequence[Effect]) -> Callable[[Problem], float]:
    """The error of a set of effects on other windows."""
    return lambda problem: residual_error(problem, problem.residual([list(effects)])[0])
