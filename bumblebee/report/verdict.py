"""The first lines of the report: what a person would say after reading all of it, good and bad, from the numbers."""

from itertools import pairwise

from bumblebee.report import noise_floor
from bumblebee.report.names import label, ladder, last_policy, pair
from bumblebee.report.page import Fact
from bumblebee.report.policy_sections import ENGINES, NOT_YOURS, engines
from bumblebee.report.residual_figure import value_and_interval
from bumblebee.report.results import Json, LoopResults, RoundResults
from bumblebee.report.success_figure import pick
from bumblebee.report.truth import match
from bumblebee.report.wording import changes, number, percent, plural

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
    hits, sealed, false = _hits(results.sealed["effects"], found)
    return f"Round {turn.n}: {hits} of {plural(sealed, 'sealed effect')} found; {false} reported that {_were(false)}."


def _were(count: int) -> str:
    return "was not sealed" if count == 1 else "were not sealed"


def _hits(sealed: list[Json], found: list[Json]) -> tuple[int, int, int]:
    """(sealed and found, sealed, found but not sealed)."""
    rows = match(sealed, found)
    hits = sum(1 for row in rows if row.sealed is not None and row.found is not None)
    return hits, len(sealed), sum(1 for row in rows if row.sealed is None)


def _errors(turn: RoundResults) -> tuple[str, dict[str, Json]] | None:
    """The horizon to tell about, and the joint position error there of every block."""
    error = turn.diagnosis["error"]
    horizon = "0.2" if "0.2" in error["before"] else next(iter(error["before"]), "")
    names = ("before", "after", "floor")
    return (horizon, {name: error[name][horizon]["joint_pos_rmse"] for name in names}) if horizon else None


def _error(turn: RoundResults) -> str:
    found = _errors(turn)
    if found is None:
        return f"Round {turn.n}: no held-out rollouts, so no error before and after."
    horizon, entries = found
    before, after, floor = (number(_pair(entries[name]), 2, 1e3) for name in ("before", "after", "floor"))
    meaning = noise_floor.meaning(entries["after"], entries["floor"])
    return (
        f"Round {turn.n}, held-out joint error after {horizon} s: {before} mrad with the declared model, {after} mrad "
        f"with the corrected one; noise floor {floor} mrad" + (f" ({meaning})." if meaning else ".")
    )


def _pair(entry: Json) -> Json:
    value, low, high = value_and_interval(entry)
    return {"value": value, "ci95": (None, None) if low != low else (low, high)}


def _delta(turn: RoundResults) -> str:
    kept = [cluster for cluster, card in turn.deltas.items() if card["promoted"]]
    if not turn.deltas:
        return ""
    if not kept:
        return f"Round {turn.n}: no delta action beat the corrected model without one; none was kept."
    return f"Round {turn.n}: delta actions kept for {', '.join(kept)}."


def facts(results: LoopResults) -> list[Fact]:
    """The few numbers to read first."""
    engine, last = engines(results)[0], last_policy(results)
    rates = {
        split: pick(results.evaluation["results"], policy=last, engine=engine, split=split, group="all")
        for split in ("train", "test")
    }
    told = []
    if rates["train"]:
        held_out = f"; held out: {percent(rates['test'][0]['success'])}" if rates["test"] else ""
        value, _, interval = percent(rates["train"][0]["success"]).partition(" [")
        told.append(
            Fact(
                f"Training motions that the {last} follows to the end, {ENGINES[engine]}",
                value,
                f"[{interval}{held_out}",
            )
        )
    for turn in results.rounds[-1:]:
        told += _round_facts(results, turn)
    models = results.published.get("models", {})
    if models:
        champions = sum(1 for model in models.values() if model.get("champion") is not None)
        told.append(Fact("In the registry", plural(len(models), "policy"), f"{champions} with a @champion"))
    return told


def _round_facts(results: LoopResults, turn: RoundResults) -> list[Fact]:
    found, told = turn.diagnosis["effects"], []
    if results.sealed is None:
        told.append(Fact(f"Effects found, round {turn.n}", str(len(found)), "that the declared model lacks"))
    else:
        hits, sealed, false = _hits(results.sealed["effects"], found)
        told.append(
            Fact(
                f"Sealed effects found, round {turn.n}", f"{hits} of {sealed}", f"{false} reported that {_were(false)}"
            )
        )
    errors = _errors(turn)
    if errors is not None:
        horizon, entries = errors
        before, after = (1e3 * value_and_interval(entries[name])[0] for name in ("before", "after"))
        floor = f"declared → corrected model; noise floor {number(_pair(entries['floor']), 2, 1e3)}"
        label = f"Joint error after {horizon} s, held out, round {turn.n}"
        told.append(Fact(label, f"{before:.2f} → {after:.2f} mrad", floor))
    return told


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
