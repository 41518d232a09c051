"""Sections about each round with the robot: what came, effects found beside the truth, error before and after."""

from typing import Any

from bumblebee.report import noise_floor
from bumblebee.report.charts.residual_chart import residual_chart, value_and_interval
from bumblebee.report.page import Block, Cell, Section, bullets, heading, note, replay, table, text
from bumblebee.report.results import LoopResults, RoundResults
from bumblebee.report.sections.compensation import compensation_table
from bumblebee.report.truth import Match, match
from bumblebee.report.wording import effect_line, plural, signed

Json = dict[str, Any]
_MEASURES = (
    ("joint_pos_rmse", "joint positions", 1e3, "mrad"),
    ("joint_vel_rmse", "joint velocities", 1.0, "rad/s"),
    ("base_pos_rmse", "base position", 1e3, "mm"),
    ("base_rot_rmse", "base rotation", 1e3, "mrad"),
    ("chi2", "chi² (1: noise alone)", 1.0, ""),
)


def round_section(results: LoopResults, turn: RoundResults) -> Section:
    """One round."""
    diagnosis = turn.diagnosis
    blocks: list[Block] = [text(_arrived(turn))]
    blocks += [heading("Effects that the simulator lacked"), *_effects(results.sealed, diagnosis)]
    undone = compensation_table(turn.compensation)
    blocks += [heading("Undone at the joint, without training"), *undone] if undone else []
    blocks.append(heading("Error of the simulator before and after"))
    blocks += residual_chart(diagnosis["error"])
    held = plural(len(diagnosis["holdout"]), "rollout")
    blocks += [note(f"On {held} that took no part in fitting. {noise_floor.WHAT}"), _error_table(diagnosis["error"])]
    shown = results.players.get(f"windows-r{turn.n}", "")
    blocks += [replay(shown)] if shown else []
    under = noise_floor.summary(diagnosis["error"], [key for key, *_ in _MEASURES if key != "chi2"])
    blocks += [note(under)] if under else []
    blocks.append(text(_remains(diagnosis)))
    blocks += [heading("Delta actions"), *_deltas(turn.deltas)]
    return Section(f"round-{turn.n}", f"Round {turn.n} with the robot", tuple(blocks))


def _arrived(turn: RoundResults) -> str:
    seen, gate = turn.intake, turn.gate
    words = (
        f"{plural(seen['accepted'], 'rollout')} accepted ({seen['seconds']:.0f} s), {seen['quarantined']} set aside. "
    )
    when = str(gate.get("at", "an unknown time")).replace("T", " ").replace("+00:00", " UTC")
    by, said = str(gate.get("by", "nobody")), f" \u201c{gate['note']}\u201d" if gate.get("note") else ""
    if by.startswith("automatic"):
        return f"{words}The gate was {gate['status']} without asking a person (gate.mode: auto), {when}.{said}"
    how = gate.get("known_by", {}).get("how")
    known = f" (known by: {how})" if how else ""
    return f"{words}The gate was {gate['status']} by {by}{known}, {when}.{said}"


def _effects(sealed: Json | None, diagnosis: Json) -> list[Block]:
    found = diagnosis["effects"]
    if sealed is None:
        rows = [(*effect_line(effect), _share(effect)) for effect in found]
        nothing = [] if rows else [text("No effect passed the tests: the declared model stands.")]
        return [
            *nothing,
            table(("effect", "estimate [95 %]", "declared", "lost without it"), rows, "", "effects found"),
        ]
    compared = [_truth_row(pair) for pair in match(sealed["effects"], found)]
    if not compared:
        return [text("Nothing was sealed and nothing was found: no false alarm.")]
    header = ("sealed in the stand-in", "sealed value", "found", "estimate [95 %]", "lost without it")
    caption = (
        "Lost without it: share of what all effects together take off the held-out error that comes back when this one "
        "is left out; shares need not sum to 100 %. The diagnosis cannot read the seal."
    )
    return [table(header, compared, caption, "effects sealed and found")]


def _truth_row(pair: Match) -> tuple[str | Cell, ...]:
    truth, value = ("–", "–")
    if pair.sealed is not None:
        truth = f"{pair.sealed['effect'].replace('_', ' ')} on {', '.join(pair.sealed['where'])}"
        value = ", ".join(
            f"{k} {v:.4g} {pair.sealed.get('unit', '')}".strip() for k, v in pair.sealed["parameters"].items()
        )
    if pair.found is None:
        return truth, value, Cell("not found", "missed"), "–", "–"
    name, estimate, _ = effect_line(pair.found)
    estimate += pair.told
    if pair.sealed is None:
        return truth, value, Cell(f"{name} (not sealed)", "missed"), estimate, _share(pair.found)
    how = {"exact": "found", "class": f"its class: {name}", "form": f"as a law without a name: {name}"}
    mark = Cell(how[pair.through], "found")
    return truth, value, mark, estimate, _share(pair.found)


def _share(effect: Json) -> str:
    share = effect.get("explains")
    return "–" if share is None else f"{100 * share:.0f} %"


def _error_table(error: Json) -> Block:
    rows = []
    for horizon in error["before"]:
        shown = f"{horizon} s"  # once, in front of its measures
        for key, name, factor, unit in _MEASURES:
            cells = [
                _cell(error.get(block, {}).get(horizon, {}).get(key), factor) for block in ("before", "after", "floor")
            ]
            if cells[0] != "–":
                rows.append((shown, f"{name} [{unit}]" if unit else name, *cells))
                shown = ""
    header = ("after", "error", "declared model", "corrected model", "noise floor")
    return table(header, rows, "", "error by horizon", folded="Error by horizon, all measures")


def _cell(entry: Any, factor: float) -> str:
    if entry is None:
        return "–"
    value, low, high = value_and_interval(entry)
    if value != value:
        return "–"
    text_ = f"{factor * value:.3g}"
    return text_ if low != low else f"{text_} [{factor * low:.3g}, {factor * high:.3g}]"


def _remains(diagnosis: Json) -> str:
    left = diagnosis["unexplained"]
    p = left.get("p")
    size = "" if p is None else f" (p = {p:.2g})"
    if not left["significant"]:
        return f"What remains shows no structure that these data could prove{size}."
    where = ", ".join(left["where"]) or "no single joint"
    depends = ", ".join(left["depends_on"]) or "nothing simple"
    return f"What remains has structure{size}, in {where}, depending on {depends}. {left.get('description', '')}"


def _deltas(cards: dict[str, Json]) -> list[Block]:
    rows, lines = [], []
    for cluster, card in cards.items():
        held = card["held_out"]
        for horizon, c in held["change"].items():
            verdict = Cell("kept", "found") if card["promoted"] else "not kept"
            changed = "nothing corrected" if c["with"] == c["without"] else _change(c)
            rows.append((cluster, f"{horizon} s", f"{c['without']:.4f}", f"{c['with']:.4f}", changed, verdict))
        if not held["change"]:
            lines.append(f"{cluster}: no held-out rollouts, so nothing was kept.")
    header = ("cluster", "after", "without delta [rad]", "with delta [rad]", "change [95 %]", "delta")
    explained = note(
        "Joint position error on held-out rollouts. A delta is kept only if the interval of the change after 1 s lies "
        "below zero. The interval is over motions: rollouts of one motion count as one, and one motion gives none."
    )
    return [table(header, rows, "", "delta actions"), explained, *([bullets(lines)] if lines else [])]


def _change(c: Json) -> str:
    """A relative change in percent with its interval, where there is one."""
    low, high = c["low"], c["high"]
    words = f"{signed(100 * c['relative'], 1)} %"
    if low is None or low != low:
        return f"{words}, no interval"
    return f"{words} [{signed(100 * low, 1)}, {signed(100 * high, 1)}]"
