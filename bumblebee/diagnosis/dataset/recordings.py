"""The files of a dataset as they come to the checks: cut at pauses, with velocities of the positions' time."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco

from bumblebee.diagnosis.dataset.velocity_latency import with_known_velocities
from bumblebee.diagnosis.thresholds.dataset import VelocityLatency
from bumblebee.errors import BadInput
from bumblebee.measured.pauses import cut_at_pauses, cut_note
from bumblebee.measured.rollout import Rollout, read_rollout


@dataclass(frozen=True)
class Recordings:
    """Rollouts of a dataset as read, and what was done to them."""

    named: tuple[tuple[str, Rollout], ...]
    """(file, rollout); parts of a recording have files of their own names."""
    errors: tuple[tuple[str, BadInput], ...]
    """(id, why it cannot be read)."""
    notes: tuple[str, ...]
    """Changes of whole recordings."""


def read_recordings(files: Sequence[Path], model: mujoco.MjModel, rule: VelocityLatency) -> Recordings:
    """Read rollouts, with those cut that pause; on a fixed base velocities that are too old are replaced."""
    named, errors, cut = [], [], []
    for file in files:
        try:
            rollout = read_rollout(file)
        except BadInput as error:
            errors.append((file.stem, error))
            continue
        parts = cut_at_pauses(rollout)
        if parts == [rollout]:
            named.append((file.name, rollout))
            continue
        cut.append((file.stem, parts))
        named += [(f"{part.rollout_id}.parquet", part) for part in parts]
    notes = cut_note(cut)
    if (model.jnt_type != mujoco.mjtJoint.mjJNT_FREE).all():
        known, told = with_known_velocities([rollout for _, rollout in named], rule)
        named, notes = [(name, one) for (name, _), one in zip(named, known, strict=True)], notes + told
    return Recordings(tuple(named), tuple(errors), tuple(notes))
