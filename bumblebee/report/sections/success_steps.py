"""Success on the robot before, compensated and refined, beside the declared model and beside the controls."""

from dataclasses import dataclass

from bumblebee.report.charts.success_figure import pick
from bumblebee.report.names import pair, reference, same_files
from bumblebee.report.results import Json, RoundResults
from bumblebee.report.wording import change

ROBOT, DECLARED = "stand_in", "nominal"


@dataclass(frozen=True)
class Step:
    """One policy's success, `{"value", "ci95"}` or None where it was not run."""

    policy: str
    """Its name in the evaluation."""
    called: str
    note: str
    robot: Json | None
    declared: Json | None
    control: bool = False


def success_steps(summary: Json, turn: RoundResults, base: str) -> tuple[Step, ...]:
    """Steps that were evaluated: the loop's beginning, before, compensated, refined, the generalist, the two controls.

    Args:
        summary: data/evaluation/summary.json.
        turn: the round with the robot.
        base: what the policy that the loop began with is called; no row of its own where `before` is the same file.
    """
    (before, after), first = names(turn), reference(summary)
    same = same_files(summary, first, before)
    kept = any(card.get("promoted") for card in turn.deltas.values())
    refined = "the same files as before" if same_files(summary, before, after) else "in the corrected model"
    rows = [
        (first, base, "where the loop began", False),
        (before, "before", f"the same file as {base}" if same else "experts as they were", False),
        (f"{before}-compensated", "compensated", "same files, no training", False),
        (after, "refined", refined + (", with delta actions" if kept else ""), False),
        ("generalist", "generalist", "one policy from all experts", False),
        (f"control-declared-r{turn.n}", "control: declared model", "same steps, no correction", True),
        (f"control-delta-r{turn.n}", "control: delta alone", "same steps, declared model", True),
    ]
    steps = [
        Step(policy, called, note, _rate(summary, policy, ROBOT), _rate(summary, policy, DECLARED), control)
        for policy, called, note, control in rows
        if not (policy == first and same)
    ]
    return tuple(step for step in steps if step.robot or step.declared)


def names(turn: RoundResults) -> tuple[str, str]:
    """The experts that ran on the robot in the round, and those that came out of it."""
    return f"experts-r{turn.parent}", f"experts-r{turn.n}"


def step_differences(summary: Json, turn: RoundResults, engine: str = ROBOT) -> list[str]:
    """Paired differences in success, `refined − before: +58 points [40, 76], p = 0.0001: better`."""
    before, after = names(turn)
    called = {
        ("compensated", "before"): (before, f"{before}-compensated"),
        ("refined", "before"): (before, after),
        ("refined", "compensated"): (f"{before}-compensated", after),
        ("refined", "control: declared model"): (f"control-declared-r{turn.n}", after),
        ("refined", "control: delta alone"): (f"control-delta-r{turn.n}", after),
    }
    found = {words: pair(summary, a, b, engine) for words, (a, b) in called.items()}
    return [
        f"{b} against {a}: {_told(c)}"
        for (b, a), c in found.items()
        if c is not None and all(_rate(summary, c[side], engine) for side in ("from", "to"))
    ]


def _told(entry: Json) -> str:
    """The change in success; where that shows nothing, the one in the key bodies' error beside it."""
    said = change(entry)
    error = (entry.get("mpkpe_mm") or {}).get("value")
    told = "no difference shown" in said and error is not None and not entry.get("unchanged")
    return f"{said}; MPKPE {change(entry, 'mpkpe_mm')}" if told else said


def _rate(summary: Json, policy: str, engine: str) -> Json | None:
    found = pick(summary["results"], policy=policy, engine=engine, split="all", group="all")
    return found[0]["success"] if found and found[0]["success"]["value"] is not None else None
