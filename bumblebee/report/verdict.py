"""The first lines of the report: what a person would say after reading all of it, good and bad, from the numbers."""

from itertools import pairwise

from bumblebee.report.held_out import error_line
from bumblebee.report.names import label, ladder, last_policy, pair
from bumblebee.report.policy_sections import ENGINES, NOT_YOURS, engines
from bumblebee.report.results import LoopResults, RoundResults
from bumblebee.report.success_figure import pick
from bumblebee.report.truth import hits
from bumblebee.report.wording import changes, percent, plural

PRETRAINED = (
    "Training began from the policy that comes along, which real motions on a GPU had taught most of this already; "
    "motions held out here may be among what it saw (bumblebee/learning/pretrained/README.md)."
)


def verdict(results: LoopResults) -> list[str]:
    """Sentences."""
    lines = [_headline(results), PRETRAINED if results.pretrained else "", NOT_YOURS if results.real_robot else ""]
    lines += _first_steps(results)
    for turn in results.rounds:
        lines += [_found(results, turn), _error(turn), _delta(turn)]
    return [line for line in lines if line] + _short(results)


def _headline(results: LoopResults) -> str:
    engine = engines(results)[0]
    last = last_policy(results)
    rates = {
        split: pick(results.evaluation["results"], policy=last, engine=engine, split=split, group="all")
        for split in ("train", "test")
    }
    said = [
        f"{percent(found[0]['success'])} of the {name} motions"
        for (split, found), name in zip(rates.items(), ("training", "held-out"), strict=True)
        if found
    ]
    untrained = pick(results.evaluation["results"], policy="untrained", engine=engine, split="all", group="all")
    start = f" (untrained: {percent(untrained[0]['success'])})" if untrained else ""
    return f"{last.capitalize()} {ENGINES[engine]}: {' and '.join(said)} followed to the end{start}."


def _first_steps(results: LoopResults) -> list[str]:
    engine, names = engines(results)[0], ladder(results)
    pairs = {(a, b): pair(results.evaluation, a, b, engine) for a, b in pairwise(names[1:])}
    where = ENGINES[engine].capitalize()
    return [
        f"{where}, {label(results, a)} → {label(results, b)}: {changes(found)}."
        for (a, b), found in pairs.items()
        if found is not None
    ]


def _found(results: LoopResults, turn: RoundResults) -> str:
    found = turn.diagnosis["effects"]
    if results.sealed is None:
        return f"Round {turn.n}: {plural(len(found), 'effect')} found that the declared model lacks."
    there, sealed, false = hits(results.sealed["effects"], found)
    return f"Round {turn.n}: {there} of {plural(sealed, 'sealed effect')} found; {false} reported that {_were(false)}."


def _were(count: int) -> str:
    return "was not sealed" if count == 1 else "were not sealed"


def _error(turn: RoundResults) -> str:
    line = error_line(turn)
    return f"Round {turn.n}: {line[:1].lower()}{line[1:]}"


def _delta(turn: RoundResults) -> str:
    kept = [cluster for cluster, card in turn.deltas.items() if card["promoted"]]
    if not turn.deltas:
        return ""
    if not kept:
        return f"Round {turn.n}: no delta action beat the corrected model without one; none was kept."
    return f"Round {turn.n}: delta actions kept for {', '.join(kept)}."


def _short(results: LoopResults) -> list[str]:
    """Families in which the last policy fails more often than not."""
    engine, last = engines(results)[0], last_policy(results)
    weak = [
        f"{e['group']} ({100 * e['success']['value']:.0f} %)"
        for e in pick(results.evaluation["results"], policy=last, engine=engine, split="all", group_by="family")
        if e["success"]["value"] is not None and e["success"]["value"] < 0.5
    ]
    where = f"{last} {ENGINES[engine]} follows fewer than half of the motions of"
    return [f"Falls short: {where} {', '.join(weak)}."] if weak else []
