"""Measured rollouts as the world model sees transitions: states at the control step, targets, and the rows between.

Time stamps wander and ticks go missing. States are interpolated onto a grid of the control step, each step is given the
command that was issued nearest to its beginning, and a rollout is cut where a tick is missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import mujoco
import numpy as np
import torch
from scipy.spatial.transform import Rotation, Slerp
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.learning.delta import Recordings, recorded_state, stack
from bumblebee.learning.world_model.body import packed
from bumblebee.learning.world_model.memory import Windows
from bumblebee.measured.checks import Thresholds
from bumblebee.measured.rollout import COMMANDS, VECTORS, Rollout

HELD = (*COMMANDS, "action")
"""Columns that hold from one control tick to the next; the others are samples."""
LIMITS = Thresholds()


@dataclass(frozen=True)
class Measured:
    """Gapless stretches of measured rollouts, laid end to end in N rows."""

    recordings: Recordings
    """One entry a stretch; `ids` are those of the rollouts, so that several stretches may have the same."""
    bodies: Tensor
    """(N, 13 + 2 J) states as the robot's sensors read them, see `body`."""

    def to(self, device: torch.device | str) -> "Measured":
        """Copy to a device."""
        return Measured(self.recordings.to(device), self.bodies.to(device))

    @property
    def provenance(self) -> dict[str, int]:
        """Rollout id -> control steps that were taken from it."""
        taken = dict.fromkeys(self.recordings.ids, 0)
        for name, length in zip(self.recordings.ids, self.recordings.length.tolist(), strict=True):
            taken[name] += length - 1
        return taken

    def first_rows(self, steps: int, past: int = 1, stride: int = 1) -> Tensor:
        """Rows (W,) from which `steps` control steps and the `past` targets before them lie in one stretch."""
        rows = self.recordings.windows(steps, 1)
        offset = rows - self.recordings.start[self.recordings.owner(rows)]
        return rows[(offset >= past) & ((offset - past) % stride == 0)]

    def windows(self, rows: Tensor, steps: int, past: int = 1, context: int = 0) -> Windows:
        """Stretches of `steps` control steps from `rows` (B,), see `first_rows`.

        Args:
            rows: first rows.
            steps: K.
            past: P, earlier targets that the model is shown.
            context: C, entries of the model's context: zeros, since a measured robot is taken for the mean one.
        """
        targets = self.recordings.targets
        along = rows + torch.arange(steps + 1, device=rows.device)[:, None]
        earlier = rows[:, None] - torch.arange(1, past + 1, device=rows.device)
        return Windows(
            bodies=self.bodies[along],
            targets=targets[along[:-1]],
            before=targets[earlier].flatten(1),
            context=torch.zeros(len(rows), context, device=rows.device),
            valid=torch.ones_like(along[:-1], dtype=torch.bool),
        )


def measured(rollouts: Sequence[Rollout], model: mujoco.MjModel, dt: float, steps: int) -> Measured:
    """Rollouts of the G1 as stretches of the world model's states.

    Args:
        rollouts: as they were measured; they stay as they are.
        model: the declared model, which gives a start height where no place was logged.
        dt: control step of the world model [s].
        steps: control steps that a stretch must have to be of use, those for earlier targets included.

    Raises:
        BadInput: for another robot or rate, a state of the base that was not logged, or no stretch that is long enough.
    """
    found = [stretch for rollout in rollouts for stretch in regular(rollout, dt) if stretch.frames > steps]
    if not found:
        longest = max((rollout.duration for rollout in rollouts), default=0.0)
        came = f"{len(rollouts)} rollouts, the longest of {longest:.2f} s"
        raise BadInput("measured rollouts", f"one of {steps * dt:g} s without a gap", came, "Record longer.")
    recordings = stack(found, model)
    return Measured(recordings, packed(recorded_state(recordings)))


def regular(rollout: Rollout, dt: float) -> list[Rollout]:
    """The gapless stretches of a rollout, at least 2 rows each, on a grid of `dt` [s]; one tick is one step.

    Raises:
        BadInput: for a rollout of another control rate.
    """
    if abs(rollout.control_hz * dt - 1) > LIMITS.rate_warn:
        came = f"{rollout.control_hz:g} Hz"
        do = "Leave it out: a command that is held for another time is another step."
        raise BadInput(f"{rollout.rollout_id}: control_hz", f"the world model's {1 / dt:g} Hz", came, do)
    ends = [0, *(np.flatnonzero(np.diff(rollout.time) > LIMITS.gap_warn * dt) + 1), rollout.frames]
    return [_gridded(rollout, first, last, dt) for first, last in pairwise(ends) if last > first + 1]


def _gridded(rollout: Rollout, first: int, last: int, dt: float) -> Rollout:
    """Rows `first` to `last`, the last left out, on a grid that begins with the first."""
    own = slice(first, last)
    time = rollout.time[own] - rollout.time[first]
    grid = dt * np.arange(int(time[-1] / dt + 1e-6) + 1)
    inside = np.minimum(grid, time[-1])
    nearest = np.searchsorted(0.5 * (time[1:] + time[:-1]), grid)
    columns = {}
    for name in VECTORS:
        values = getattr(rollout, name)
        if values is None:
            continue
        if name in HELD:
            columns[name] = values[own][nearest]
        elif name == "base_quat":
            turn = Slerp(time, Rotation.from_quat(values[own], scalar_first=True))(inside)
            columns[name] = turn.as_quat(scalar_first=True)
        else:
            flat = values[own].reshape(len(time), -1)
            between = np.stack([np.interp(inside, time, column) for column in flat.T], axis=1)
            columns[name] = between.reshape(len(grid), *values.shape[1:])
    return replace(rollout, time=grid, **columns)
