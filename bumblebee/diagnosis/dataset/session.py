"""Session that diagnose, replay and gap share: the data matched with the model, noise, the split, the steps."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset.conventions import wrong_conventions
from bumblebee.diagnosis.dataset.declared_contacts import without_contradicted
from bumblebee.diagnosis.dataset.held_out import HeldOut, condition_notes, split_by
from bumblebee.diagnosis.dataset.noise import estimate_noise
from bumblebee.diagnosis.dataset.own_step import agreed_steps
from bumblebee.diagnosis.dataset.recordings import read_recordings
from bumblebee.diagnosis.dataset.smoothing import smooth_rollouts
from bumblebee.diagnosis.dataset.split import accepting, accepting_across, motion_names, split
from bumblebee.diagnosis.dataset.told_once import told_once
from bumblebee.diagnosis.dataset.undriven import undriven_warnings
from bumblebee.diagnosis.dataset.velocity_latency import age_note, in_step, velocity_ages, with_known_velocities
from bumblebee.diagnosis.simulation import (
    Layout,
    Plant,
    layout_of,
    make_plants,
    refuse_unlogged,
)
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds, Usable
from bumblebee.errors import BadInput
from bumblebee.io.there import require_logs
from bumblebee.measured.checks import beyond
from bumblebee.measured.model_file import load_spec
from bumblebee.measured.rollout import Rollout, rollout_files
from bumblebee.measured.usable import review
from bumblebee.robot.drives import explicit_drives

JUDGED_TWICE = "the held-out rollouts decided which effects were accepted (model selection), never how large they are"
NO_HEIGHT = "no base_pos: the base's height is estimated from stance, its error is a nuisance parameter"


@dataclass(frozen=True, eq=False, repr=False)
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
    """Warnings that every report of this model and these rollouts must show."""
    thresholds: DatasetThresholds = field(default_factory=DatasetThresholds)
    """Thresholds for the use of its rollouts."""
    held_out: HeldOut | None = None
    """The condition by which rollouts are held out; None: by motion."""

    def ids(self, which: Sequence[int]) -> list[str]:
        """Rollout ids of indices."""
        return [self.rollouts[i].rollout_id for i in which]

    def __repr__(self) -> str:
        seconds = sum(float(rollout.time[-1] - rollout.time[0]) for rollout in self.rollouts)
        rates = ", ".join(f"{hz:g}" for hz in sorted({rollout.control_hz for rollout in self.rollouts}))
        count = f"{len(self.rollouts)} rollouts ({len(self.holdout)} held out), {len(self.set_aside)} set aside"
        joints = ", ".join(self.plant.joints)
        return f"<Session {self.spec.modelname!r}: {count}; {seconds:.1f} s at {rates} Hz; joints {joints}>"


def open_session(
    model: Path, dataset: Path, thresholds: DatasetThresholds | None = None, held_out: HeldOut | None = None
) -> Session:
    """Read and match a model and a dataset; rollouts are held out by motion, or by the condition `held_out`.

    Raises:
        BadInput: no rollout that can be used, or one convention that is wrong in all of them.
    """
    require_logs(Path(model), Path(dataset))
    rules = thresholds or DatasetThresholds()
    files = rollout_files(dataset)
    if not files:
        raise BadInput(Path(dataset) / "rollouts", "at least one *.parquet", "none")
    spec = load_spec(model)
    declared = explicit_drives(spec)[0].compile()
    read = read_recordings(files, declared, rules.velocity_latency)
    judged = [(name, rollout, review(rollout, declared, name)) for name, rollout in read.named]
    errors = [*read.errors, *((Path(name).stem, one.refused) for name, _, one in judged if one.refused is not None)]
    reviewed = [(rollout, one) for _, rollout, one in judged]
    wrong, doubts = wrong_conventions(reviewed, dataset, rules.conventions)
    if wrong is not None:
        raise wrong
    rollouts = [rollout for rollout, one in reviewed if one.refused is None]
    if not rollouts:
        raise errors[0][1]
    lines = [line for _, one in reviewed for line in one.warnings if "rule gains" not in line]  # a note tells of gains
    session = make_session(spec, rollouts, model, dataset, errors, lines, rules, known=True)
    session = replace(session, warnings=(*session.warnings, *doubts), notes=[*read.notes, *session.notes])
    return session if held_out is None else hold_out(session, held_out, [rollout for _, rollout in read.named])


def make_session(
    spec: mujoco.MjSpec,
    rollouts: Sequence[Rollout],
    model: object,
    dataset: object,
    errors: Sequence[tuple[str, BadInput]] = (),
    warnings: Sequence[str] = (),
    thresholds: DatasetThresholds | None = None,
    known: bool = False,
) -> Session:
    """Make a session from memory; `model` and `dataset` are names for messages.

    A rollout that cannot be used is set aside with its reason, as are those in `errors` (id, error), which could not be
    read; where none is left the first reason ends it. `known`: velocities that are too old were replaced already.
    """
    rules = thresholds or DatasetThresholds()
    long, failed = _sorted_out(rollouts, dataset, errors, rules.usable)
    spec, drive_notes = explicit_drives(spec)
    plant, unmade = make_plants(spec, long, model)
    failed += unmade
    long = [r for r in long if r.rollout_id not in {name for name, _ in unmade}]
    refuse_unlogged(plant, model)
    undriven = undriven_warnings(plant, long, model)
    has_pos = all(r.base_pos is not None for r in long)
    layout = layout_of(plant, has_pos)
    old: list[str] = []
    if not plant.floating and not known:
        long, old = with_known_velocities(long, rules.velocity_latency)
    sigma = estimate_noise(long, layout, rules.noise)
    spec, contradicted, contact_notes = without_contradicted(spec, plant, layout, long, sigma, rules.contacts)
    if contradicted:
        plant, _ = make_plants(spec, long, model)
    train, holdout = split(long, rules.split)
    accept = accepting(long, train, holdout, rules.split)
    notes = [f"set aside: {line}" for line in told_once([str(error) for _, error in failed])]
    notes += [f"check: {line}" for line in told_once(warnings)]
    notes += (
        condition_notes(plant, long, rules.conditions)
        + drive_notes
        + contact_notes
        + old
        + [NO_HEIGHT] * (plant.floating and not has_pos)
        + [JUDGED_TWICE] * bool(set(accept) & set(holdout))
    )
    if not plant.floating:
        long, sigma, more = _refined(plant, layout, long, sigma, rules)
        notes += more
    declared = float(spec.option.timestep)
    steps, search_step, agreed = agreed_steps(plant, declared, layout, long, sigma, rules.time_steps)
    notes += agreed
    told = (*undriven, *contradicted)
    aside = [{"rollout": name, "reason": str(error)} for name, error in failed]
    return Session(
        spec, plant, layout, long, sigma, train, holdout, accept, steps, search_step, notes, aside, told, rules
    )


def hold_out(session: Session, held_out: HeldOut, read: Sequence[Rollout] = ()) -> Session:
    """The session with the rollouts of some conditions held out; those that are left decide on acceptance, too.

    Of rollouts that were `read` and set aside, those that were to be held out are named.
    """
    reasons = {one["rollout"]: one["reason"] for one in session.set_aside}
    lost = [(r, reasons[r.rollout_id]) for r in read if r.rollout_id in reasons and held_out.matches(held_out.of(r))]
    train, holdout = split_by(session.rollouts, held_out, lost)
    fitted = [session.rollouts[i] for i in train]
    stated = [(session.plant.under.get(r.rollout_id, 0), held_out.of(r)) for r in fitted]
    rule = session.thresholds.split
    accept = [train[k] for k in accepting_across(motion_names(fitted, rule), stated, rule)]
    notes = [held_out.note(), *held_out.lost_notes(lost), *(note for note in session.notes if note != JUDGED_TWICE)]
    return replace(session, train=train, holdout=holdout, accept=accept, notes=notes, held_out=held_out)


def _sorted_out(
    rollouts: Sequence[Rollout], dataset: object, errors: Sequence[tuple[str, BadInput]], rule: Usable
) -> tuple[list[Rollout], list[tuple[str, BadInput]]]:
    """The rollouts that can be used, and the others' (id, error) after `errors`; `BadInput` where none can."""
    long: list[Rollout] = []
    failed = list(errors)
    for rollout in rollouts:
        try:
            _usable(dataset, rollout, long[0] if long else None, rule)
            long.append(rollout)
        except BadInput as error:
            failed.append((rollout.rollout_id, error))
    if not long:
        raise failed[0][1]
    return long, failed


def _refined(
    plant: Plant, layout: Layout, rollouts: Sequence[Rollout], sigma: np.ndarray, rules: DatasetThresholds
) -> tuple[list[Rollout], np.ndarray, list[str]]:
    """Rollouts of a fixed base with velocities in step and readings smoothed, the noise (D,) left, notes on both."""
    ages = velocity_ages(rollouts, rules.velocity_latency)
    notes = list(filter(None, [age_note(plant.joints, ages)]))
    moved = [in_step(rollout, ages) for rollout in rollouts]
    smooth, left, fast = smooth_rollouts(moved, layout, sigma, rules.smoothing)
    if fast:
        span = 1000 * rules.smoothing.half_span
        notes.append(f"{fast} fast rollouts: joint readings smoothed over +-{span:g} ms")
    return smooth, left, notes


def _usable(dataset: object, rollout: Rollout, first: Rollout | None, rule: Usable) -> None:
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
    if seconds < rule.seconds or rollout.frames < rule.rows:
        raise BadInput(
            f"{name}: column time",
            f"at least {rule.seconds} s and {rule.rows} rows",
            f"{seconds:.2g} s, {rollout.frames} rows",
            "Record longer runs.",
        )
    if first is not None and rollout.joints != first.joints:
        raise BadInput(f"{name}: joints", f"those of {first.rollout_id}", "others")
