"""The first lines of the report: what a person would say after reading all of it, good and bad, from the numbers."""

from itertools import pairwise

from bumblebee.report.policy_sections import ENGINES, NOT_YOURS, engines, ladder
from bumblebee.report.residual_figure import value_and_interval
from bumblebee.report.results import LoopResults, RoundResults
from bumblebee.report.success_figure import pick
from bumblebee.report.truth import match
from bumblebee.report.wording import change, percent

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
    last = ladder(results)[-1]
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
    return f"{last.capitalize()} {ENGINES[engine]}: {' and '.join(said)} are followed to the end{start}."


def _first_steps(results: LoopResults) -> list[str]:
    engine, names = engines(results)[0], ladder(results)
    pairs = {
        (c["from"], c["to"]): c
        for c in results.evaluation["comparisons"]
        if c["engine"] == engine and c["split"] == "all"
    }
    wanted = [p for p in pairwise(names[1:]) if p in pairs]
    return [f"Success {ENGINES[engine]}, {a} → {b}: {change(pairs[a, b])}." for a, b in wanted]


def _found(results: LoopResults, turn: RoundResults) -> str:
    found = turn.diagnosis["effects"]
    if results.sealed is None:
        count = f"{len(found)} effect{'' if len(found) == 1 else 's'}"
        return f"Round {turn.n}: {count} found that the declared model lacks."
    rows = match(results.sealed["effects"], found)
    hits = sum(1 for row in rows if row.sealed is not None and row.found is not None)
    false = sum(1 for row in rows if row.sealed is None)
    sealed = len(results.sealed["effects"])
    return f"Round {turn.n}: {hits} of {sealed} sealed effects found; {false} reported that were not sealed."


def _error(turn: RoundResults) -> str:
    error = turn.diagnosis["error"]
    horizon = "0.2" if "0.2" in error["before"] else next(iter(error["before"]), "")
    if not horizon:
        return f"Round {turn.n}: no held-out rollouts, so no error before and after."
    values = [
        value_and_interval(error[block][horizon]["joint_pos_rmse"])[0] * 1e3 for block in ("before", "after", "floor")
    ]
    return (
        f"Round {turn.n}, held-out joint error after {horizon} s: {values[0]:.2f} mrad before, {values[1]:.2f} mrad "
        f"after ({values[2]:.2f} mrad is sensor noise alone)."
    )


def _delta(turn: RoundResults) -> str:
    kept = [cluster for cluster, card in turn.deltas.items() if card["promoted"]]
    if not turn.deltas:
        return ""
    if not kept:
        return f"Round {turn.n}: no delta action beat the corrected model without one; none was kept."
    return f"Round {turn.n}: delta actions kept for {', '.join(kept)}."


def _short(results: LoopResults) -> list[str]:
    """Families in which the last policy fails more often than not."""
    engine, last = engines(results)[0], ladder(results)[-1]
    weak = [
        f"{e['group']} ({100 * e['success']['value']:.0f} %)"
        for e in pick(results.evaluation["results"], policy=last, engine=engine, split="all", group_by="family")
        if e["success"]["value"] is not None and e["success"]["value"] < 0.5
    ]
    where = f"{last} {ENGINES[engine]} follows fewer than half of the motions of"
    return [f"Falls short: {where} {', '.join(weak)}."] if weak else []
