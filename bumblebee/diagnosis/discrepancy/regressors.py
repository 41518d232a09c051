"""Quantities that a joint's missing torque may depend on, along the simulated paths of windows.

Position, velocity, target and the servo's torque come from the simulation that starts at the measured state; what a
joint has done before the window comes from the log: how long it has rested, where a target of limited rate would be,
where the joint stands in a play.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from bumblebee.diagnosis.sensitivities import Path
from bumblebee.diagnosis.simulation import Plant, Windows, at_starts, state_before, window_servos
from bumblebee.diagnosis.thresholds.discrepancy import DiscrepancyThresholds
from bumblebee.sim.effects import State, Term


@dataclass(frozen=True, eq=False)
class Quantities:
    """W windows of K simulation steps, J joints."""

    joints: tuple[str, ...]
    path: Path
    q: np.ndarray
    """(W, K, J) position [rad]."""
    v: np.ndarray
    """(W, K, J) velocity [rad/s]."""
    u: np.ndarray
    """(W, K, J) target [rad] or commanded torque [N m]."""
    tau: np.ndarray
    """(W, K, J) servo torque [N m]."""
    t: np.ndarray
    """(W, K) time since the rollout began [s]."""
    limit: np.ndarray
    """(J,) largest torque of the drives [N m]."""
    plant: Plant
    windows: Windows
    thresholds: DiscrepancyThresholds
    """Thresholds by which basis functions of the quantities are made and chosen."""
    _known: dict[tuple, np.ndarray] = field(default_factory=dict, repr=False)

    @property
    def tick(self) -> float:
        """Time between commands [s]."""
        return float(np.median(np.diff(self.windows.command_time, axis=1)))

    def values(self, joint: int) -> Mapping[str, np.ndarray]:
        """The names of `effects.terms` as a joint sees them, each (W, K)."""
        return _Values(self, joint)

    def torque(self, term: Term, joint: int) -> np.ndarray:
        """(W, S) mean torque of a term on a joint for coefficient 1; dry friction against the direction of motion."""
        if term.rubs or term.drives or term.states or term.names - {"t"}:
            return self._torque(term, joint)
        if (term.text,) not in self._known:  # of other joints and of time alone: the same on every joint
            self._known[(term.text,)] = self._torque(term, joint)
        return self._known[(term.text,)]

    def _torque(self, term: Term, joint: int) -> np.ndarray:
        value = np.broadcast_to(term(self.values(joint)), self.t.shape)
        if term.drives:
            value = np.where(np.abs(self.tau[..., joint]) < self.limit[..., joint], value, 0.0)
        return self.path.mean(value * self.against(joint) if term.rubs else value)

    def against(self, joint: int) -> np.ndarray:
        """(W, K): -1 where the joint moves forward, 1 where it moves back, between where it creeps."""
        if ("against", joint) not in self._known:
            self._known["against", joint] = -np.tanh(self.v[..., joint] / self.thresholds.regressors.creep)
        return self._known["against", joint]

    def state(self, joint: int, key: str, numbers: tuple[float, ...]) -> np.ndarray:
        """(W, K) of what a joint remembers, see `sim.effects.states`."""
        if (joint, key) not in self._known:
            state = State(joint, key, numbers)
            now, out = state_before(self.plant, self.windows, state), np.empty(self.t.shape)
            for k in range(self.t.shape[1]):
                now = state.at(now, self.u[:, k, joint], self.t[:, k], self.path.step)
                out[:, k] = now
                now = state.after(now, self.v[:, k, joint], self.path.step)
            self._known[joint, key] = out
        return self._known[joint, key]


class _Values(Mapping[str, np.ndarray]):
    """Names of the language -> (W, K), looked up when they are asked for."""

    def __init__(self, data: Quantities, joint: int) -> None:
        self._data, self._joint = data, joint
        self._own = ("q", "v", "u", "tau")

    def __getitem__(self, name: str) -> np.ndarray:
        if name == "t":
            return self._data.t
        if name in self._own:
            return getattr(self._data, name)[..., self._joint]
        kind, bracket, other = name.partition("[")
        if bracket:
            return getattr(self._data, kind)[..., self._data.joints.index(other[:-1])]
        numbers = name[name.index("(") + 1 : -1].split(", ")
        return self._data.state(self._joint, name, tuple(map(float, numbers)))

    def __iter__(self) -> Iterator[str]:
        return iter((*self._own, "t"))

    def __len__(self) -> int:
        return 1 + len(self._own)


def quantities(
    plant: Plant,
    windows: Windows,
    path: Path,
    models: Sequence[mujoco.MjModel],
    thresholds: DiscrepancyThresholds,
) -> Quantities:
    """From the paths of windows under the servos of `models`, one for each condition."""
    servos = window_servos(plant, windows, models)
    q, v = path.qpos[:, :-1, plant.qpos], path.qvel[:, :-1, plant.dof]
    control = servos.controls(path.control)
    clock = at_starts(windows, lambda r: r.time - r.time[0])
    return Quantities(
        joints=plant.joints,
        path=path,
        q=q,
        v=v,
        u=servos.given(control),
        tau=servos.torque(q, v, control),
        t=clock[:, None] + path.step * np.arange(q.shape[1]),
        limit=servos.limit,
        plant=plant,
        windows=windows,
        thresholds=thresholds,
    )
