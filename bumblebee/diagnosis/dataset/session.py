"""What diagnose, replay and gap share: the data matched with the model, noise, the split, the steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset.noise import estimate_noise
from bumblebee.diagnosis.dataset.smoothing import HALF_SPAN, smooth_rollouts
from bumblebee.diagnosis.dataset.split import accepting, split
from bumblebee.diagnosis.dataset.time_steps import longest_step, step_for
from bumblebee.diagnosis.dataset.undriven import undriven_warnings
from bumblebee.diagnosis.dataset.velocity_latency import age_note, in_step, velocity_ages
from bumblebee.diagnosis.simulation import (
    Layout,
    Plant,
    fold_dampers,
    layout_of,
    load_spec,
    make_plant,
    refuse_unlogged,
)
from bumblebee.errors import BadInput
from bumblebee.measured.checks import beyond
from bumblebee.measured.rollout import Rollout, read_rollout, rollout_files
from bumblebee.measured.usable import review

_FINE, _COARSE = 0.001, 0.005
# Models of more degrees of freedom than this are searched in steps twice as long, which cost half; the last fit and all
# that is reported are not. With the integrator free in every test what an effect changes was the same to 0.2 %.
_SMALL, _SEARCH = 12, 0.002
# Shorter rollouts hold no window of 0.2 s after the lead that delayed commands need.
_SHORTEST = 0.35
_MOST_WARNINGS = 12
JUDGED_TWICE = "the held-out rollouts decided which effects were accepted, never how large they are"


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
    """Rollouts that only the errors are reported on."""
    accept: list[int]
    """Rollouts that decide which effects are accepted: some of `train`, which then are not fitted; or `holdout`."""
    steps: tuple[float, float]
    """Simulation step [s] for residuals and for sensitivities."""
    search_step: float
    """Simulation step [s] for residuals while effects are sought."""
    notes: list[str]
    set_aside: list[dict[str, str]]
    """Rollouts that could not be used, with the reason."""
    warnings: tuple[str, ...] = ()
    """What must not be overlooked in any report of this model and these rollouts."""

    def ids(self, which: Sequence[int]) -> list[str]:
        """Rollout ids of indices."""
        return [self.rollouts[i].rollout_id for i in which]


def open_session(model: Path, dataset: Path) -> Session:
    """Read and match a model and a dataset."""
    rollouts, errors, warnings = [], [], []
    files = rollout_files(dataset)
    if not files:
        raise BadInput(Path(dataset) / "rollouts", "at least one *.parquet", "none")
    spec = load_spec(model)
    declared = spec.compile()
    for file in files:
        try:
            rollout = read_rollout(file)
        except BadInput as error:
            errors.append((file.stem, error))
            continue
        refused, found = review(rollout, declared, file.name)
        warnings += found
        if refused is None:
            rollouts.append(rollout)
        else:
            errors.append((file.stem, refused))
    if not rollouts:
        raise errors[0][1]
    return make_session(spec, rollouts, model, dataset, errors, warnings)


def make_session(
    spec: mujoco.MjSpec,
    rollouts: Sequence[Rollout],
    model: object,
    dataset: object,
    errors: Sequence[tuple[str, BadInput]] = (),
    warnings: Sequence[str] = (),
) -> Session:
    """The same from memory; `model` and `dataset` are names for messages.

    A rollout that cannot be used is set aside with its reason, as are those in `errors` (id, error), which could not be
    read; where none is left the first reason ends it.
    """
    notes: list[str] = []
    long: list[Rollout] = []
    failed = list(errors)
    for rollout in rollouts:
        try:
            _usable(dataset, rollout, long[0] if long else None)
            long.append(rollout)
        except BadInput as error:
            failed.append((rollout.rollout_id, error))
    if not long:
        raise failed[0][1]
    notes += [f"set aside: {error}" for _, error in failed]
    notes += [f"check: {text}" for text in warnings[:_MOST_WARNINGS]]
    if len(warnings) > _MOST_WARNINGS:
        notes.append(f"{len(warnings) - _MOST_WARNINGS} more findings that do not stop a file")
    spec, folded = fold_dampers(spec)
    if folded:
        notes.append(f"position and velocity actuators taken as one servo of one limit: {', '.join(folded[:6])}")
    plant = make_plant(spec, long[0], model)
    refuse_unlogged(plant, model)
    undriven = undriven_warnings(plant, long, model)
    has_pos = all(r.base_pos is not None for r in long)
    layout = layout_of(plant, has_pos)
    if plant.floating and not has_pos:
        notes.append("no base_pos: the base's height comes from stance, its error is a nuisance")
    train, holdout = split(long)
    accept = accepting(long, train, holdout)
    if set(accept) & set(holdout):
        notes.append(JUDGED_TWICE)
    period = float(np.median(np.diff(long[0].time)))
    declared = float(spec.option.timestep)
    steps = (step_for(period, min(_FINE, declared)), longest_step(period, _COARSE))
    small = plant.model.nv <= _SMALL
    search_step = steps[0] if small else max(steps[0], step_for(period, min(_SEARCH, declared)))
    sigma = estimate_noise(long, layout)
    if not plant.floating:
        ages = velocity_ages(long)
        notes += filter(None, [age_note(plant.joints, ages)])
        long = [in_step(rollout, ages) for rollout in long]
        long, sigma, fast = smooth_rollouts(long, layout, sigma)
        if fast:
            notes.append(f"{fast} fast rollouts: joint readings smoothed over +-{1000 * HALF_SPAN:g} ms")
    aside = [{"rollout": name, "reason": str(error)} for name, error in failed]
    return Session(
        spec, plant, layout, long, sigma, train, holdout, accept, steps, search_step, notes, aside, tuple(undriven)
    )


def _usable(dataset: object, rollout: Rollout, first: Rollout | None) -> None:
    """`BadInput` for a rollout that no window may start in: not a number, too large, too short, other joints."""
    name = f"{dataset}: {rollout.rollout_id}"
    for column in ("time", *rollout.columns):
        values = np.asarray(getattr(rollout, column))
        bad = ~np.isfinite(values.reshape(len(values), -1)).all(axis=1)
        if bad.any():
            where = f"{name}: column {column}: row {int(np.flatnonzero(bad)[0])}: rule finite"
            raise BadInput(where, "finite numbers", "NaN or infinity", "Set the file aside or repair the logger.")
    for large in beyond(rollout)[:1]:
        where = f"{name}: column {large.column}: row {large.row}: rule magnitude"
        raise BadInput(where, large.expected, large.came, "Set the file aside or repair the logger.")
    if rollout.frames > 1 and (np.diff(rollout.time) <= 0).any():
        row = int(np.flatnonzero(np.diff(rollout.time) <= 0)[0]) + 1
        raise BadInput(
            f"{name}: column time: row {row}: rule increasing", "strictly increasing times", "a step back or a repeat"
        )
    seconds = rollout.time[-1] - rollout.time[0]
    if seconds < _SHORTEST or rollout.frames < 12:
        raise BadInput(
            f"{name}: column time", f"at least {_SHORTEST} s and 12 rows", f"{seconds:.2g} s, {rollout.frames} rows",
            "Record longer runs.",
        )  # fmt: skip
    if first is not None and rollout.joints != first.joints:
        raise BadInput(f"{name}: joints", f"those of {first.rollout_id}", "others")
