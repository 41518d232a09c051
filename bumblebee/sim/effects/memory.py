"""Memory of the effects that have one: what worlds remember at a start, and what is carried from step to step."""

from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.sim.effects.hooks import RuntimeHooks
from bumblebee.sim.servo import Servos


@dataclass(frozen=True, eq=False)
class Memory:
    """Memory of n worlds at their start, where it is not what a world at rest would remember."""

    time: np.ndarray
    """(n,) [s] since the rollout began."""
    heat: np.ndarray
    """(n, J) [s]: integral of (torque / limit)^2."""
    torque: np.ndarray | None = None
    """(n, J) [N m]: state of the torque's lag."""
    position: np.ndarray | None = None
    """(n, L, J): readings at the steps before, the newest last."""
    velocity: np.ndarray | None = None
    """(n, L, J)."""
    states: np.ndarray | None = None
    """(n, C): those of discovered terms, see `effects.states.states_of`."""
    bent: np.ndarray | None = None
    """(n, H): z of Dahl's law on the H joints that have it."""


# What is carried from step to step: saved, and on a GPU kept in place. tests/test_forgotten.py finds what is missing.
REMEMBERED = ("time", "heat", "lagged", "fresh", "past_q", "past_v", "past_u", "states", "bent", "setpoint", "pace")


def bent(z: np.ndarray, path: np.ndarray, width: float) -> np.ndarray:
    """Dahl's z (n,) after a `path` (n,) [rad] one way: it goes to the path's sign over the `width` [rad]."""
    way = np.sign(path)
    return np.where(way != 0, way + (z - way) * np.exp(-np.abs(path) / width), z)


def history_length(hooks: RuntimeHooks, step: float) -> int:
    """L: how many steps of readings the longest encoder delay looks back."""
    longest = float(hooks.encoder_delay.max(initial=0.0))
    return int(np.ceil(longest / step - 1e-9)) + 1 if longest > 0 else 0


def steps_held_back(model: mujoco.MjModel, servos: Servos) -> np.ndarray:
    """(J,) physics steps by which MuJoCo's own buffers hold the servos' commands back, one at least; 0 without one."""
    a = np.maximum(servos.actuator, 0)
    if not model.nu:
        return np.zeros(len(a))
    has = (servos.actuator >= 0) & (model.actuator_history[a, 0] > 0)
    return np.where(has, np.maximum(model.actuator_delay[a] / model.opt.timestep, 1.0), 0.0)
