"""Failures of a finished loop, each with one thing to do next that works as printed."""

from bumblebee.report.charts.success_figure import pick
from bumblebee.report.effect_words import named
from bumblebee.report.names import label, last_policy, pair
from bumblebee.report.results import Json, LoopResults, RoundResults
from bumblebee.report.sections.policy_sections import ENGINES, engines
from bumblebee.report.sections.success_steps import DECLARED, names
from bumblebee.report.truth import match
from bumblebee.report.wording import change, plural

_MOTIONS = "Next: raise refine.{}.iterations in params.yaml, then start the same command again."
_MEASURE = "Next: more rollouts tell more: raise rollouts.repeats in params.yaml, then start the same command again."
_MEASURE_REAL = "Next: more rollouts tell more: other motions, at other speeds, with other loads."


def next_steps(results: LoopResults) -> list[str]:
    """Lines; the first says which motions are lost, the others what the diagnosis could not tell."""
    lines = [_lost(results)]
    if results.rounds:
        lines += [_unnamed(results, results.rounds[-1])]
    return [line for line in lines if line]


def price(results: LoopResults, turn: RoundResults) -> str:
    """A sentence where the refined policy follows worse than before on the declared model; else ""."""
    first, last = names(turn)
    compared = pair(results.evaluation, first, last, DECLARED)
    if compared is None or compared.get("unchanged"):
        return ""
    worse = [told for measure in ("success", "mpjpe_rad", "mpkpe_mm") if (told := _worse(results, compared, measure))]
    return (
        f"The price: on the declared model the refined policy is worse than before: {'; '.join(worse)}."
        if worse
        else ""
    )


def _worse(results: LoopResults, compared: Json, measure: str) -> str:
    """`joint error 19 to 33 mrad (+14.1 mrad [12.0, 16.0], p = 0.0002)` where a measure is shown to be worse."""
    if not (compared.get(measure) or {}) or not (told := change(compared, measure)).endswith(": worse"):
        return ""
    name, factor = {"success": ("success", 100), "mpjpe_rad": ("joint error", 1e3), "mpkpe_mm": ("key bodies", 1)}[
        measure
    ]
    ends = [_rate(results, compared[side], measure) for side in ("from", "to")]
    sizes = "" if None in ends else " {:.0f} to {:.0f}".format(*(factor * end for end in ends if end is not None))
    unit = {"success": "%", "mpjpe_rad": "mrad", "mpkpe_mm": "mm"}[measure]
    return f"{name}{sizes + ' ' + unit if sizes else ''} ({told.removesuffix(': worse')})"


def _rate(results: LoopResults, policy: str, measure: str) -> float | None:
    found = pick(results.evaluation["results"], policy=policy, engine=DECLARED, split="all", group="all")
    return found[0][measure]["value"] if found else None


def _lost(results: LoopResults) -> str:
    """Families of which the last policy loses motions, the worst first."""
    engine, last = engines(results)[0], last_policy(results)
    rows = [
        (entry["success"]["value"], entry["group"] or "unknown", entry["success"]["motions"])
        for entry in pick(results.evaluation["results"], policy=last, engine=engine, split="all", group_by="family")
        if entry["success"]["value"] is not None and entry["success"]["value"] < 1
    ]
    if not rows:
        return ""
    told = ", ".join(f"{group} {100 * rate:.0f} % of {plural(count, 'motion')}" for rate, group, count in sorted(rows))
    do = _MOTIONS.format(_refiner(results))
    return f"Not followed to the end by {label(results, last)} {ENGINES[engine]}: {told}. {do}"


def _refiner(results: LoopResults) -> str:
    """The learner of the last round's experts; PPO, the default, where none is known."""
    end = f" r{results.rounds[-1].n}" if results.rounds else " r0"
    return next((by for name, by in results.learners.items() if name.endswith(end)), "ppo")


def _unnamed(results: LoopResults, turn: RoundResults) -> str:
    """Sealed effects that were missed and structure that is left, with the runs that would tell more."""
    sealed = (results.sealed or {}).get("effects", [])
    missed = [named(row.sealed) for row in match(sealed, turn.diagnosis["effects"]) if row.sealed and not row.found]
    left = turn.diagnosis["unexplained"]
    told = f"Not found: {', '.join(missed)}. " if missed else ""
    if left["significant"]:
        told += f"Unexplained: {left.get('description') or 'structure in ' + ', '.join(left['where'])}. "
    return f"{told}{_MEASURE_REAL if results.real_robot else _MEASURE}" if told else ""
