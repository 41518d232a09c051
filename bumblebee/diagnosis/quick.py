"""A first look: what `gap` finds, on few windows, and the effects that explain most of it when each is taken alone.

What a lead explains is measured on windows that took no part in its fit. That it is this effect, and what comes beside
it, the diagnosis alone can tell.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from threadpoolctl import threadpool_limits

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.gap import Gap, gap
from bumblebee.diagnosis.report import at_bounds, far_off, missing_lines, told_horizon
from bumblebee.diagnosis.selection import Lead, Leads, leads
from bumblebee.diagnosis.simulation import Plant, of_joint, unit_on
from bumblebee.sim.effects import CATALOGUE


@dataclass(frozen=True)
class QuickConfig:
    """How much work a first look does."""

    windows: int = 40
    """Fitted windows: those that the screening of a whole diagnosis takes."""
    validation_windows: int = 20
    candidates: int = 3
    """Leads at most."""
    notes: int = 3
    """Notes told at most; how many more follows."""


@dataclass(frozen=True, eq=False)
class FirstLook:
    """Outcome of a first look."""

    report: Gap
    """Where the declared model errs, on the same windows."""
    leads: Leads
    plant: Plant
    notes: list[str]
    """Notes of the report, and on models and steps that failed."""


def first_look(
    session: Session,
    config: DiagnosisConfig | None = None,
    quick: QuickConfig | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> FirstLook:
    """The declared model's errors and the candidates that explain most of them."""
    quick, config = quick or QuickConfig(), config or DiagnosisConfig()
    config = replace(config, max_windows=quick.windows, max_holdout_windows=quick.validation_windows, grow=False)
    report, found, plant = gap(session, quick.windows, config, say), Leads([], []), session.plant
    if report.torque is not None:
        m, lacking = report.torque.material, report.document["missing_torque"]
        plant = m.session.plant
        quiet = [j for j in plant.joints if j not in lacking or not lacking[j]["significant"]]
        with threadpool_limits(1, user_api="blas"):
            found = leads(m.problem, m.holdout, m.remade, config.search, say, quick.candidates, quiet)
    notes = [*plant.failures.notes(quick.notes), *report.document["notes"]]
    more = len(notes) - quick.notes
    notes = [*notes[: quick.notes], f"{more} more: `bumblebee gap` lists them"] if more > 0 else notes
    return FirstLook(report, found, plant, notes)


def told(look: FirstLook, whole: str) -> str:
    """A first look as text: what is sure, the leads, what stays open; `whole` is the command of the whole diagnosis."""
    document, rules, found = look.report.document, look.report.thresholds.report, look.leads
    lines = [f"WARNING: {text}" for text in document["warnings"]]
    lines += [_furthest(document, rules.matters.places)]
    lines += ["torque that the declared model lacks, nothing fitted; sure where a size is given:"]
    lines += missing_lines(document, rules.verdicts)
    if found.together:
        share = 100 * found.together[0].explains
        lines.append(f"leads, standard parameters by inverse dynamics, explain {share:.0f} %:")
        lines += [
            f"  {place}: {', '.join(_sized(look, s, 2) for s in some)}" for place, some in _places(found.together)
        ]
    if found.alone:
        lines.append("leads, each fitted alone:")
    for place, (best, *others) in _places(found.alone):
        rivals = ", ".join(f"{lead.candidate.effect} ({100 * lead.explains:.0f} %)" for lead in others)
        said = f"{_sized(look, best)} (z = {best.z:.1f})"
        lines.append(f"  {place}: {said}, explains {100 * best.explains:.0f} %")
        lines += [f"    or {rivals}"] if rivals else []
    if found.together or found.alone:
        lines += ["open: which of these it is, and what comes beside it. To tell them apart:", f"  {whole}"]
    elif off := far_off(document["error"], document["floor"], rules.verdicts):
        lines += [f"the declared model errs by {size}" for size in off]
        lines.append("no single effect explains that: its drives, or the whole model, are off. To fit them together:")
        lines.append(f"  {whole}")
    else:
        lines.append("no effect of the catalogue is sure alone")
    return "\n".join([*lines, *(f"note: {note}" for note in look.notes)])


def _furthest(document: Mapping[str, Any], most: int) -> str:
    """Joints whose position the declared model misses most, in one line."""
    horizon = told_horizon(document["error"])
    if horizon is None:
        return "the runs are too short to say how far the declared model is off"
    each = document["error"][horizon]["joint_pos_rmse"]["per_joint"]
    sizes = sorted(((e["value"], joint) for joint, e in each.items() if e["value"] is not None), reverse=True)[:most]
    said = (f"{joint} {1e3 * value:.3g} m{of_joint(document, joint, 'position')}" for value, joint in sizes)
    return f"declared model, after {horizon} s, the joints that are furthest off: {', '.join(said)}"


def _places(found: Sequence[Lead]) -> list[tuple[str, list[Lead]]]:
    """Leads by where they act, in their order."""
    places = dict.fromkeys(lead.candidate.where for lead in found)
    return [(where or "whole robot", [s for s in found if s.candidate.where == where]) for where in places]


def _sized(look: FirstLook, lead: Lead, digits: int = 4) -> str:
    """Effect with its free parameters."""
    c, values = lead.candidate, list(lead.candidate.at(lead.values).values())
    parts = []
    for i in c.free:
        p = CATALOGUE[c.effect].parameters[i]
        unit = unit_on(look.plant, c.effect, c.where, p.unit)
        parts.append(f"{p.name} = {values[i]:.{digits}g} {unit}".rstrip())
    ends = ", at the end of the values that are tried" if at_bounds(c, lead.values).any() else ""
    return f"{c.effect} {', '.join(parts)}{ends}"
