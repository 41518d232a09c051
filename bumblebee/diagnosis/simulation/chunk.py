"""Windows and variations that run in one batch, and the states that they start from."""

from dataclasses import dataclass, replace

import numpy as np
from mujoco.batch import Batch

from bumblebee.diagnosis.simulation.batches import batch_of, with_step
from bumblebee.diagnosis.simulation.inputs import inputs_of
from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.roll import roll
from bumblebee.diagnosis.simulation.starts.activations import activations
from bumblebee.diagnosis.simulation.starts.actuator_history import read_at
from bumblebee.diagnosis.simulation.starts.base_height import heights_of
from bumblebee.diagnosis.simulation.starts.hidden_states import Known, earlier, restructured, set_plastic
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows
from bumblebee.quaternions import conjugate, from_rotation_vector, multiply, rotate_by_cross


@dataclass(frozen=True, eq=False)
class Starts:
    """Start states that replace the measured ones: qpos (K, W, nq), qvel (K, W, nv)."""

    qpos: np.ndarray
    qvel: np.ndarray

    def part(self, rows: range) -> "Starts":
        """Those of a stretch of the first axis."""
        return Starts(self.qpos[rows.start : rows.stop], self.qvel[rows.start : rows.stop])


@dataclass(frozen=True, eq=False)
class Chunk:
    """Windows of a plant under some variations, or under one from some starts, that run in one batch."""

    plant: Plant
    windows: Windows
    chosen: list[Variation]
    starts: Starts | None
    """Starts of this chunk alone."""
    step: float
    """[s]"""

    @property
    def lead(self) -> Variation:
        """The first variation, which stands for all but in model, delay and offset."""
        return self.chosen[0]

    @property
    def own(self) -> Plant:
        """The plant of the simulated model."""
        return self.lead.plant or self.plant

    @property
    def offset(self) -> np.ndarray:
        """(V, 1, J) what encoders add [rad]."""
        return np.stack([v.offset for v in self.chosen])[:, None, :]

    def batch(self) -> Batch:
        """A batch of all windows under all variations, in the chunk's step."""
        for model in {id(m): m for v in self.chosen for m in v.models}.values():
            with_step(model, self.step)
        return batch_of(self.plant, self.windows, self.chosen)

    def begun(self, late: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Start states (V, W, nq), (V, W, nv) of the simulated model; encoders are `late` (J,) [s]."""
        plant, windows, lead = self.plant, self.windows, self.lead
        if self.starts is None:
            qpos = np.repeat(windows.qpos[None], len(self.chosen), axis=0)
            qvel = np.repeat(windows.qvel[None], len(self.chosen), axis=0)
        else:
            qpos, qvel = self.starts.qpos.copy(), self.starts.qvel
        qpos, qvel = self._as_it_was(qpos, qvel, late)
        if windows.stance:
            qpos[..., plant.base_qpos + 2] += self._raised(late)
        if lead.plant is not None:
            qpos, qvel = restructured(plant, windows, lead, qpos, qvel, _led_in(plant, windows, lead, self.step))
        return qpos, qvel

    def _as_it_was(self, qpos: np.ndarray, qvel: np.ndarray, late: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States (..., W, nq), (..., W, nv) that were read, as they were by what the variations say of the sensors."""
        qpos = qpos.copy()
        qpos[..., self.plant.qpos] -= self.offset
        if late.any():
            qpos, qvel = _caught_up(self.plant, self.windows, qpos, qvel, late)
        if self.lead.tilt is not None:
            qpos, qvel = _righted(self.plant, qpos, qvel, self.lead.tilt)
        return qpos, qvel

    def _raised(self, late: np.ndarray) -> np.ndarray:
        """How much higher (V, W) [m] the base stands than the readings as they are put it: its feet touch the floor."""
        offsets, which = np.unique(self.offset[:, 0], axis=0, return_inverse=True)
        if self.lead.tilt is None and not late.any() and not offsets.any():
            return np.zeros((len(self.chosen), len(self.windows)))
        read, speed = self.windows.qpos[None], self.windows.qvel[None]
        first = [self.chosen[int(np.argmax(which == k))] for k in range(len(offsets))]
        right, _ = replace(self, chosen=first, starts=None)._as_it_was(read, speed, late)
        return (heights_of(self.plant, right) - heights_of(self.plant, read))[which]


def lateness(plant: Plant, lead: Variation) -> np.ndarray:
    """How old readings are when they are logged, (J,) [s]."""
    out = np.zeros(len(plant.joints))
    if lead.hooks is not None:
        out[[plant.joints.index(name) for name in lead.hooks.joints]] = lead.hooks.encoder_delay
    return out


def _led_in(plant: Plant, windows: Windows, lead: Variation, step: float) -> Known | None:
    """State that a model with shafts has come to at the windows' starts."""
    if not any(kind == "series_elasticity" for kind, _, _ in lead.hidden):
        return None
    early, span, whole = earlier(plant, windows)
    early.qpos[:, plant.qpos] -= lead.offset
    qpos, qvel = restructured(plant, early, lead, early.qpos, early.qvel)
    batch = batch_of(plant, early, [lead])
    batch.bind("qpos")[:], batch.bind("qvel")[:] = qpos, qvel
    set_plastic(batch, plant, early, lead, 1)
    control = inputs_of(early, lead, step, max(1, round(span / step)), {})
    if lead.model.na:
        batch.bind("act")[:] = activations(early, lead, control[:, 0])
    path_q, path_v, failed = roll(batch, plant, early, [lead], control)
    return path_q[:, -1], path_v[:, -1], whole & ~failed


def _caught_up(
    plant: Plant, windows: Windows, qpos: np.ndarray, qvel: np.ndarray, late: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Starts in which joints with late encoders are where a later reading puts them."""
    some, rule = np.flatnonzero(late), plant.thresholds.path
    moved, still = (read_at(windows, 0.0, delay, some, rule) for delay in (late[some], 0.0 * late[some]))
    qpos, qvel = qpos.copy(), qvel.copy()
    qpos[..., plant.qpos[some]] += moved[0] - still[0]
    qvel[..., plant.dof[some]] += moved[1] - still[1]
    return qpos, qvel


def _righted(plant: Plant, qpos: np.ndarray, qvel: np.ndarray, tilt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts whose base stands as it is, not as a tilted sensor says; velocities in the base's frame stay."""
    qpos, qvel = qpos.copy(), qvel.copy()
    at, dof = slice(plant.base_qpos + 3, plant.base_qpos + 7), slice(plant.base_dof, plant.base_dof + 3)
    speed_b = rotate_by_cross(conjugate(qpos[..., at]), qvel[..., dof])
    qpos[..., at] = multiply(qpos[..., at], conjugate(from_rotation_vector(tilt)))
    qvel[..., dof] = rotate_by_cross(qpos[..., at], speed_b)
    return qpos, qvel
