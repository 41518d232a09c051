"""A first look: the error of the declared model, and the candidates that explain most of it when each is taken alone.

Fewer windows and one round of the search: each candidate alone, and where the model is far off the effects of many
joints that the search begins with. What it names is a lead, not a finding: effects that come together, or that pass for
one another, are told apart by the diagnosis alone.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.prepare import Material, gather
from bumblebee.diagnosis.selection import Lead, leads
from bumblebee.diagnosis.simulation import joint_units, residuals, unit_on, vary
from bumblebee.sim.effects import CATALOGUE


@dataclass(frozen=True)
class QuickConfig:
    """How much work a first look does."""

    windows: int = 40
    """Fitted windows: those that the screening of a whole diagnosis takes."""
    validation_windows: int = 20
    candidates: int = 3
    """Leads at most."""
    joints: int = 3
    """Joints that are furthest off, listed with their error."""
    notes: int = 3
    """Failures told at most; how many more follows."""


@dataclass(frozen=True, eq=False)
class FirstLook:
    """Outcome of a first look."""

    horizon: float
    """[s] of the windows."""
    errors: list[tuple[str, float, str]]
    """Joint, RMS position error of the declared model at the end of the windows, unit; the furthest first."""
    together: list[Lead]
    """Effects of many joints that were fitted together, as the declared model is far off."""
    leads: list[Lead]
    """Single effects beside them."""
    bound: float
    """z that a candidate had to reach."""
    units: dict[tuple[str, str, str], str]
    """(effect, place, parameter) -> unit."""
    notes: list[str]
    """Notes on the dataset (what was set aside), and on models and steps of the search that failed."""
    warnings: tuple[str, ...] = ()
    """Warnings about the dataset that must not be overlooked."""


def first_look(
    session: Session,
    config: DiagnosisConfig | None = None,
    quick: QuickConfig | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> FirstLook:
    """The declared model's errors and the candidates that explain most of them."""
    quick, config = quick or QuickConfig(), config or DiagnosisConfig()
    config = replace(config, max_windows=quick.windows, max_holdout_windows=quick.validation_windows, grow=False)
    with threadpool_limits(1, user_api="blas"):
        material = gather(session, config, np.random.default_rng(config.seed), say)
        found = leads(material.problem, material.holdout, material.remade, config.search, say, quick.candidates)
    plant = material.session.plant
    units = {
        (c.effect, c.where, p.name): unit_on(plant, c.effect, c.where, p.unit)
        for c in (lead.candidate for lead in (*found.together, *found.alone))
        for p in CATALOGUE[c.effect].parameters
    }
    notes = [*material.session.notes, *plant.failures.notes(quick.notes)]
    errors = _errors(material, quick.joints)
    together, alone, warnings = found.together, found.alone, material.session.warnings
    return FirstLook(config.horizon, errors, together, alone, found.bound, units, notes, warnings)


def _errors(material: Material, most: int) -> list[tuple[str, float, str]]:
    """Joints whose position the declared model misses most at the end of the fitted windows, with unit."""
    problem, plant = material.problem, material.session.plant
    raw = residuals(plant, problem.layout, problem.windows, [vary(plant, [])], problem.fine)[0]
    last = raw[:, -1, problem.layout.slices["joint_pos"]]
    rms = np.sqrt(np.nanmean(np.where(np.isfinite(last), last, np.nan) ** 2, axis=0))
    units, order = joint_units(plant), np.argsort(-rms)[:most]
    return [(plant.joints[j], float(rms[j]), units[plant.joints[j]]["position"]) for j in order]


def told(look: FirstLook) -> str:
    """A first look as text."""
    lines = [f"WARNING: {text}" for text in look.warnings]
    lines += [f"declared model, after {look.horizon:g} s, the joints that are furthest off:"]
    lines += [f"  {joint:<28} {1e3 * error:.3g} m{unit}" for joint, error, unit in look.errors]
    notes = [f"note: {note}" for note in look.notes]
    if look.together:
        lines.append(f"leads, fitted together, explain {100 * look.together[0].explains:.0f} %; the model is far off:")
        lines += [_line(look, lead, "") for lead in look.together]
    if look.leads:
        beside = "beside these" if look.together else "alone"
        said = "effects that come together or pass for one another are not told apart"
        lines.append(f"leads, each fitted {beside}; {said}:")
        lines += [_line(look, lead, f", explains {100 * lead.explains:.0f} %") for lead in look.leads]
    if not look.together and not look.leads:
        lines.append(f"no effect of the catalogue is sure alone (z of {look.bound:.2g} asked)")
    return "\n".join([*lines, *notes])


def _line(look: FirstLook, lead: Lead, explains: str) -> str:
    c, parts = lead.candidate, []
    values = dict(zip((p.name for p in CATALOGUE[c.effect].parameters), c.at(lead.values).values(), strict=True))
    for i, (name, value) in enumerate(values.items()):
        if i in c.free:
            parts.append(f"{name} = {value:.4g} {look.units[c.effect, c.where, name]}".rstrip())
    place = c.where or "whole robot"
    return f"  {c.effect:<20} {place:<28} {', '.join(parts)}{explains} (z = {lead.z:.1f})"
