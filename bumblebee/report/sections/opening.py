"""The report's first screen: what was undeclared, what was found, what it gained, and what it looks like."""

from collections.abc import Sequence

from bumblebee.report.charts.success_figure import pick
from bumblebee.report.effect_words import found_size, named, outside, places, sealed_size
from bumblebee.report.held_out import error_line
from bumblebee.report.names import label, last_policy, pair, reference, same_files
from bumblebee.report.page import Bar, Block, Cell, Section, Share, bars, bullets, heading, note, pairs, text, warning
from bumblebee.report.results import Json, LoopResults, RoundResults
from bumblebee.report.sections.compensation import compensation_line, planned
from bumblebee.report.sections.next_steps import next_steps, price
from bumblebee.report.sections.policy_sections import ENGINES, engines
from bumblebee.report.sections.success_steps import ROBOT, Step, names, step_differences, success_steps
from bumblebee.report.truth import Match, hits, match
from bumblebee.report.wording import percent, plural

_BRACKETS = "Motions followed to the end. Square brackets: 95 % interval."
_NOTHING = (
    "0 % lost without it: the tests hold the effect for real, but the others predict the held-out rollouts as well. "
    "It may matter in other motions."
)
_WIRE = (
    "The measured rollouts came over a wire (rollouts.wire: lcm), behind the guard of bumblebee deploy run: {:.1f} ms "
    "from a state's stamp to the drives. That latency is the whole robot's command delay; success is measured without."
)
_ON_ROBOT, _ON_DECLARED = ("on the robot", "on the declared model")


def opening(results: LoopResults, film: Sequence[Block] = ()) -> Section:
    """Everything above the fold; `film` is shown as it is, with its heading."""
    turn = _last(results)
    blocks: list[Block] = [warning(paid)] if turn is not None and (paid := price(results, turn)) else []
    if turn is not None:
        blocks += [
            heading("Undeclared, and found" if results.sealed is not None else "Found"),
            *_effects(results, turn),
        ]
        blocks += [heading("Success"), *_success(results, turn)]
    blocks += film
    if todo := next_steps(results):
        blocks += [heading("What still fails, and what to do next"), bullets(todo)]
    return Section("opening", "What this loop showed", tuple(blocks))


def opening_lines(results: LoopResults) -> list[str]:
    """First lines of the report for a terminal."""
    lines, turn = [headline(results)], _last(results)
    if turn is None:
        return lines
    lines += [paid] if (paid := price(results, turn)) else []
    for *row, share in effect_rows(results, turn):
        lines.append(" -> ".join(row) + f" (lost without it: {share})")
    lines += [*_remarks(results, turn), error_line(turn)]
    for step in _steps(results, turn):
        told = [f"{percent(rate)} {where}" for rate, where in _rates(results, step) if rate is not None]
        lines.append(f"{step.called}: {', '.join(told)}")
    return lines + _differences(results, turn) + next_steps(results)


def effect_rows(results: LoopResults, turn: RoundResults) -> list[tuple[str, ...]]:
    """(undeclared, found, explained share) in words; without the first where there is no seal."""
    return [tuple(_plain(cell) for cell in row) for row in _rows(results, turn)]


def headline(results: LoopResults) -> str:
    """The loop in two sentences."""
    return " ".join(_headlines(results))


def _headlines(results: LoopResults) -> list[str]:
    """Sentences on what was undeclared and found, and how far the robot was won back; nothing without any of these."""
    turn = _last(results)
    if turn is None:
        return ["No round with the robot.", _lone_success(results)]
    found = turn.diagnosis["effects"]
    if results.sealed is None:
        there = f"{plural(len(found), 'effect')} found that the declared model of your robot lacks."
        return [there, *(["Success was measured in simulation only."] if _steps(results, turn) else [])]
    if not results.sealed["effects"]:
        return [_null(results, turn, found)]
    return [line for line in (_counted(results.sealed["effects"], turn.diagnosis), _climb(results, turn)) if line]


def _counted(effects: list[Json], diagnosis: Json) -> str:
    """How many were undeclared, found, flagged, and reported without being there."""
    count, sealed, false = hits(effects, diagnosis["effects"])
    flagged = sum(_flagged(row, diagnosis) for row in match(effects, diagnosis["effects"]))
    were = "was" if sealed == 1 else "were"
    told = f"{plural(sealed, 'effect')} of the stand-in robot {were} not in its model; {count} found"
    told += f", {flagged} flagged" if flagged else ""
    return told + (f", {false} reported that {'is' if false == 1 else 'are'} not there." if false else ".")


def _climb(results: LoopResults, turn: RoundResults) -> str:
    """Success on the robot along the round, beside what the experts reach on the declared model."""
    steps = {step.called: step for step in _steps(results, turn)}
    told = [f"{_short(steps[c].robot)} {c}" for c in ("before", "compensated", "refined") if c in steps]
    if not told:
        return ""
    declared = steps["before"].declared if "before" in steps else None
    beside = f"; on the declared model {_short(declared)}" if declared is not None else ""
    return f"Motions followed on the robot: {', '.join(told)}{beside}."


def _short(rate: Json | None) -> str:
    return "not run" if rate is None else f"{100 * rate['value']:.0f}\u00a0%"


def _lone_success(results: LoopResults) -> str:
    engine, last = engines(results)[0], last_policy(results)
    found = pick(results.evaluation["results"], policy=last, engine=engine, split="all", group="all")
    rate = percent(found[0]["success"]) if found else "an unknown share"
    return f"{label(results, last).capitalize()} {ENGINES[engine]}: {rate} of the motions followed to the end."


def _null(results: LoopResults, turn: RoundResults, found: list[Json]) -> str:
    """A robot that lacks nothing: the loop must find nothing and leave everything as it is."""
    changed = _changed(results, turn)
    if found:
        listed = "; ".join(f"{named(effect)} {found_size(effect)}" for effect in found)
        said = f"Nothing was undeclared; wrongly found: {listed}."
        return f"{said} Changed on that ground: {', '.join(changed)}." if changed else f"{said} Nothing was changed."
    wrongly = turn.diagnosis["unexplained"]["significant"]
    named_nothing = "nothing was named, but structure was wrongly flagged" if wrongly else "nothing was found"
    if not changed:
        return f"Nothing was undeclared; {named_nothing}; nothing was changed."
    return f"Nothing was undeclared; {named_nothing}; changed nevertheless: {', '.join(changed)}."


def _changed(results: LoopResults, turn: RoundResults) -> list[str]:
    before, after = names(turn)
    compared = pair(results.evaluation, before, after, engines(results)[0]) is not None
    kept = [cluster for cluster, card in turn.deltas.items() if card["promoted"]]
    undone = sum(entry.done for entry in planned(turn.compensation))
    return [
        *([f"{plural(undone, 'compensation')} set"] if undone else []),
        *([f"delta actions kept for {', '.join(kept)}"] if kept else []),
        *(["experts trained on"] if compared and not same_files(results.evaluation, before, after) else []),
    ]


def _effects(results: LoopResults, turn: RoundResults) -> list[Block]:
    rows = _rows(results, turn)
    if results.sealed is None:
        header: tuple[str, ...] = ("found, not in the declared model", "lost without it")
    else:
        header = ("undeclared", "found", "lost without it")
    shown = [pairs(header, rows, "effects")] if rows else []
    nothing = [] if rows or results.sealed is not None else [text("No effect passed the tests: the model stands.")]
    return [*shown, *nothing, *(note(line) for line in _remarks(results, turn)), text(error_line(turn))]


def _rows(results: LoopResults, turn: RoundResults) -> list[tuple[str | Cell, ...]]:
    """(sealed, found, explained share), or without the first where there is no seal."""
    found = turn.diagnosis["effects"]
    if results.sealed is None:
        return [(f"{named(effect)}: {found_size(effect)}", _share(effect)) for effect in found]
    return [
        (_sealed(row), _found(row, turn.diagnosis), _share(row.found))
        for row in match(results.sealed["effects"], found)
    ]


def _sealed(row: Match) -> str | Cell:
    if row.sealed is None:
        return Cell("not sealed", "missed")
    beyond = " (outside the catalogue)" if outside(row.sealed) else ""
    return f"{named(row.sealed)}: {sealed_size(row.sealed)}{beyond}"


def _found(row: Match, diagnosis: Json) -> Cell:
    if row.found is None:
        return Cell(_left_over(diagnosis), "flagged") if _flagged(row, diagnosis) else Cell("not found", "missed")
    size = found_size(row.found)
    if row.sealed is None:
        return Cell(f"{named(row.found)}: {size}", "missed")
    if row.through == "form":
        return Cell(f"{named(row.found)}: {size}", "found")
    if row.through == "class":
        return Cell(f"its class: {named(row.found)}: {size}", "found")
    return Cell(f"{size}{row.told}", "found")


def _flagged(row: Match, diagnosis: Json) -> bool:
    """Whether a sealed effect that was not found lies where the diagnosis says that structure remains."""
    left = diagnosis["unexplained"]
    if row.sealed is None or row.found is not None or not left["significant"]:
        return False
    return bool(set(left["where"]) & set(row.sealed["where"]))


def _left_over(diagnosis: Json) -> str:
    left = diagnosis["unexplained"]
    depends = ", ".join(left["depends_on"]) or "nothing simple"
    return f"not named, but flagged: structure left in {places(left['where'])}, depending on {depends}"


def _remarks(results: LoopResults, turn: RoundResults) -> list[str]:
    """Say what is the wire's, explain a share of 0 %, and say what was undone at the joint."""
    nothing = any(_share(effect).startswith("0") for effect in turn.diagnosis["effects"])
    wire = "" if results.wire is None else _WIRE.format(1e3 * results.wire)
    return [line for line in (wire, _NOTHING if nothing else "", compensation_line(turn.compensation)) if line]


def _share(effect: Json | None) -> str:
    share = None if effect is None else effect.get("explains")
    return "–" if share is None else f"{100 * share:.0f}\u00a0%"


def _success(results: LoopResults, turn: RoundResults) -> list[Block]:
    steps = _steps(results, turn)
    if not steps:
        return [text("No policy of this round was evaluated.")]
    told = any(step.declared for step in steps)
    header = ("" if results.real_robot else _ON_ROBOT, _ON_DECLARED if told else "")
    rows = [
        Bar(s.called, s.note, _bar(None if results.real_robot else s.robot), _bar(s.declared), s.control) for s in steps
    ]
    return [bars(rows, header, "success", _BRACKETS)]


def _differences(results: LoopResults, turn: RoundResults) -> list[str]:
    return step_differences(results.evaluation, turn, engines(results)[0] if results.real_robot else ROBOT)


def _steps(results: LoopResults, turn: RoundResults) -> list[Step]:
    """The rows of success; where the robot is real, those alone that ran on the declared model."""
    steps = success_steps(results.evaluation, turn, label(results, reference(results.evaluation)))
    return [step for step in steps if step.declared is not None or not results.real_robot]


def _rates(results: LoopResults, step: Step) -> list[tuple[Json | None, str]]:
    declared = (step.declared, _ON_DECLARED)
    return [declared] if results.real_robot else [(step.robot, _ON_ROBOT), declared]


def _bar(rate: Json | None) -> Share | None:
    if rate is None:
        return None
    low, high = rate["ci95"]
    return Share(rate["value"], low, high, percent(rate))


def _last(results: LoopResults) -> RoundResults | None:
    return results.rounds[-1] if results.rounds else None


def _plain(cell: str | Cell) -> str:
    return cell.text if isinstance(cell, Cell) else cell
