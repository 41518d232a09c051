"""Correction of the declared model: what a diagnosis found, a delta action, or both."""

from dataclasses import dataclass
from pathlib import Path

import mujoco

from bumblebee.learning.delta import action_adapter, load_delta
from bumblebee.sim.effects import RuntimeHooks, read_effects, runtime_hooks
from bumblebee.tracking.env import ActionAdapter
from bumblebee.tracking.observing.observations import action_scale


@dataclass(frozen=True)
class Correction:
    """Folders of what was found; None: nothing."""

    diagnosis: Path | None = None
    delta: Path | None = None
    """Used whether or not it beat none: the benchmarks ask what it is worth."""

    @property
    def model(self) -> Path | None:
        """The corrected MJCF; None: the declared model."""
        return self.diagnosis / "model.xml" if self.diagnosis else None

    def hooks(self, model: mujoco.MjModel) -> RuntimeHooks | None:
        """The effects that MJCF cannot hold."""
        return runtime_hooks(read_effects(self.diagnosis / "effects.yaml"), model) if self.diagnosis else None

    def adapter(self) -> ActionAdapter | None:
        """The delta action as the environment takes it."""
        delta = load_delta(self.delta, promoted_only=False) if self.delta else None
        return action_adapter(delta, action_scale()) if delta is not None else None


DECLARED = Correction()
