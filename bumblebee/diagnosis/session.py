"""What diagnose, replay and gap share: the data matched with the model, noise, the split, the steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.diagnosis.noise import estimate_noise
from bumblebee.diagnosis.plant import Plant, load_spec, make_plant
from bumblebee.diagnosis.signals import Layout, layout_of
from bumblebee.diagnosis.simulate import step_for
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout, read_dataset

_FINE, _COARSE = 0.001, 0.005
# Shorter rollouts hold no window of 0.2 s after the lead that delayed commands need.
_SHORTEST = 0.35


@dataclass(frozen=True, eq=False)
class Session:
    """A model and its rollouts, ready to compare."""

    spec: mujoco.MjSpec
    plant: Plant
    layout: Layout
    rollouts: list[Rollout]
    sigma: np.ndarray
    """(D,) noise of every signal."""
    train: list[int]
    holdout: list[int]
    steps: tuple[float, float]
    """Simulation step [s] for residuals and for sensitivities."""
    notes: list[str]

    def ids(self, which: Sequence[int]) -> list[str]:
        """Rollout ids of indices."""
        return [self.rollouts[i].rollout_id for i in which]


def open_session(model: Path, dataset: Path) -> Session:
    """Read and match a model and a dataset."""
    rollouts = read_dataset(dataset).rollouts
    return make_session(load_spec(model), rollouts, model, dataset)


def make_session(spec: mujoco.MjSpec, rollouts: Sequence[Rollout], model: object, dataset: object) -> Session:
    """The same from memory; `model` and `dataset` are names for messages."""
    notes = []
    long = [r for r in rollouts if r.time[-1] - r.time[0] >= _SHORTEST and r.frames >= 12]
    if not long:
        raise BadInput(dataset, f"a rollout of at least {_SHORTEST} s", "only shorter ones", "Record longer runs.")
    if len(long) < len(rollouts):
        notes.append(f"{len(rollouts) - len(long)} rollouts shorter than {_SHORTEST} s were not used")
    for rollout in long:
        if rollout.joints != long[0].joints:
            raise BadInput(f"{dataset}: {rollout.rollout_id}: joints", f"those of {long[0].rollout_id}", "others")
        _finite(dataset, rollout)
    plant = make_plant(spec, long[0], model)
    has_pos = all(r.base_pos is not None for r in long)
    layout = layout_of(plant, has_pos)
    if plant.floating and not has_pos:
        notes.append("no base_pos: the base's height comes from stance, its error is a nuisance")
    train, holdout = split(long)
    if holdout:
        notes.append("the held-out rollouts decided which effects were accepted, never how large they are")
    else:
        notes.append("a single rollout: nothing could be held out; errors are those of the fitted data")
    period = float(np.median(np.diff(long[0].time)))
    declared = float(spec.option.timestep)
    steps = (step_for(period, min(_FINE, declared)), step_for(period, _COARSE))
    return Session(spec, plant, layout, long, estimate_noise(long, layout), train, holdout, steps, notes)


def split(rollouts: Sequence[Rollout]) -> tuple[list[int], list[int]]:
    """Indices to fit and to hold out: of each cluster's motions every fourth, with all their repeats.

    A repeat of a fitted motion would be no test: the same policy goes the same way again. Where a cluster, or a dataset
    that names no motions, has one motion only, every fourth of its rollouts is held out (the second of two).
    """
    clusters: dict[str, dict[str, list[int]]] = {}
    for i in sorted(range(len(rollouts)), key=lambda i: rollouts[i].rollout_id):
        meta = rollouts[i].meta
        motions = clusters.setdefault(str(meta.get("cluster")), {})
        motions.setdefault(str(meta.get("motion")), []).append(i)
    holdout: list[int] = []
    for _, motions in sorted(clusters.items()):
        groups = [group for _, group in sorted(motions.items())]
        if len(groups) == 1:
            groups = [[i] for i in groups[0]]
        every = min(4, len(groups))
        if len(groups) > 1:
            # Rounded up: 6 motions hold out 2, so that a delta action, too, has something to be judged by.
            count = -(-len(groups) // every)
            picked = np.unique(np.linspace(every - 1, len(groups) - 1, count).round().astype(int))
            holdout += [i for k in picked for i in groups[k]]
    if len(holdout) == len(rollouts):
        holdout = holdout[:1]
    return [i for i in range(len(rollouts)) if i not in holdout], sorted(holdout)


def _finite(dataset: object, rollout: Rollout) -> None:
    """Not-a-number anywhere ends it: no window may start from one."""
    for column in ("time", *rollout.columns):
        values = np.asarray(getattr(rollout, column))
        bad = ~np.isfinite(values.reshape(len(values), -1)).all(axis=1)
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            where = f"{dataset}: {rollout.rollout_id}: column {column}: row {row}: rule finite"
            raise BadInput(where, "finite numbers", "NaN or infinity", "Set the file aside or repair the logger.")
    if rollout.frames > 1 and (np.diff(rollout.time) <= 0).any():
        row = int(np.flatnonzero(np.diff(rollout.time) <= 0)[0]) + 1
        where = f"{dataset}: {rollout.rollout_id}: column time: row {row}: rule increasing"
        raise BadInput(where, "strictly increasing times", "a step back or a repeat")
