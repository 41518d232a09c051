"""The operator's page: a run as it is now, which anybody who is let in may stop; nothing on it starts or goes on."""

from collections.abc import Mapping
from typing import Any

from bumblebee.report.page import Block, Cell, Section, button, heading, note, pairs, render, table, text, warning

STOP_PATH = "/stop"
OLD = 2.0
"""Age of what is shown beyond which the page says so [s]; the console shows something four times a second."""

_STAGES = (
    "wake: how late a tick begins. take, think, send: its parts. policy: an answer, in its own process. state age: "
    "that of the newest state when an order goes out."
)
_PHASES = {
    "WAIT": "No torque. The operator's g at the console lets it stand up.",
    "RISE": "It goes to the motion's first frame, slowly.",
    "READY": "It holds the first frame. The operator's g lets the policy take over.",
    "BLEND": "From the held frame to the policy.",
    "RUN": "The policy runs the motion; the robot carries itself.",
    "DAMP": "Damping: kd alone. There is no way back but a new start.",
    "OFF": "No torque. The run is over.",
}


def live_page(run: Mapping[str, Any], facts: Mapping[str, Any] | None, age: float) -> str:
    """The page's HTML.

    Args:
        run: `policy`, its `hz`, `motion`, its `seconds`, `robot` (simulated or REAL), `sheet` (a line, or "").
        facts: newest of `bumblebee.wire.operator.watcher.facts_of`; None before the first.
        age: of the facts [s].
    """
    now = _now(run, facts or {}, age)
    if facts and facts.get("times"):
        now += [heading("Rules"), _rules(facts), heading("Times of the guard's ticks"), _times(facts)]
    sections = [Section("halt", "Stop", tuple(_halt())), Section("now", "Now", tuple(now))]
    subtitle = f"{run.get('motion', '?')}, policy {run.get('policy', '?')}, {run.get('robot', '?')}"
    return render("A run on a robot", subtitle, "", sections, live=True)


def _now(run: Mapping[str, Any], facts: Mapping[str, Any], age: float) -> list[Block]:
    blocks = [warning(f"{age:.0f} s old. Look at the terminal, and at the robot.")] if age > OLD else []
    if run.get("sheet"):
        blocks.append(note(str(run["sheet"])))
    phase = str(facts.get("phase", ""))
    if not phase:
        return [*blocks, text("Robot and policy are checked; nothing moves.")]
    step, asking = str(facts["step"]), ", ".join(facts["now"]) or "none"
    share = _number(None if facts["torque"] is None else 100 * facts["torque"], " % of its limit")
    end = f"{facts['room_rad']:.2f} rad, {facts['room_joint']}" if facts["room_rad"] is not None else "–"
    rows: list[tuple[str, str | Cell]] = [
        ("phase", Cell(phase, tip=_PHASES.get(phase, ""))),
        ("answer of the guard", Cell(step, mark="missed" if step in ("HOLD", "DAMP", "OFF") else "")),
        ("rules that ask for it", asking),
        ("motion", _place(run, max(facts["tick"], 0))),
        ("pelvis leans", _number(facts["lean_deg"], "° from upright")),
        ("pelvis height", _number(facts["height_m"], " m", 2)),
        ("largest torque", f"{share}, {facts['torque_joint']}"),
        ("nearest joint end", end),
        ("hottest motor", _number(facts["hottest"], " °C")),
        ("missed ticks", Cell(str(facts["missed"]), mark="missed" if facts["missed"] else "")),
        ("ticks logged", f"{facts['records']:,}"),
    ]
    return [*blocks, text(_PHASES.get(phase, "")), pairs(("", ""), rows, "the run now")]


def _halt() -> list[Block]:
    said = "As any key at the console: it damps. Going on and holding are the console's keys alone. On a robot, the "
    return [button("Stop: damp", STOP_PATH), note(f"{said}hardware's own emergency stop is quicker and surer.")]


def _rules(facts: Mapping[str, Any]) -> Block:
    rows = [(name, f"{count:,}", "yes" if name in facts["now"] else "") for name, count in facts["rules"].items()]
    if not rows:
        return text("No rule has asked for anything.")
    return table(("rule", "ticks in which it asked", "asks now"), rows, "Warnings are normal now and then.", "rules")


def _times(facts: Mapping[str, Any]) -> Block:
    rows = [(name, *(f"{value:.2f}" for value in values)) for name, values in facts["times"].items()]
    return table(("ms", "p50", "p99", "worst"), rows, _STAGES, "times")


def _place(run: Mapping[str, Any], tick: int) -> str:
    """Time in the motion, and its length; beyond its end the policy stands."""
    if "hz" not in run:
        return f"tick {tick}"
    at, whole = tick / run["hz"], run["seconds"]
    return f"{at:.1f} of {whole:.1f} s" if at <= whole else f"over after {whole:.1f} s; stands on its last frame"


def _number(value: float | None, unit: str, digits: int = 0) -> str:
    return "not measured" if value is None else f"{value:.{digits}f}{unit}"
