"""The first screen says what was undeclared, found and gained: for a stand-in, a null seal and a real robot."""

from dataclasses import replace
from typing import Any

import pytest

from bumblebee.report.effect_words import sealed_size
from bumblebee.report.page import Block
from bumblebee.report.results import LoopResults
from bumblebee.report.sections.compensation import compensation_line, compensation_table
from bumblebee.report.sections.opening import headline, opening, opening_lines
from bumblebee.report.sections.success_steps import step_differences, success_steps
from bumblebee.report.truth import match
from tests.report.made import DELAY, LAW, PLAN, TRUTH, difference, found, page_of, won_back


def of(results: LoopResults, kind: str) -> list[Block]:
    return [block for block in opening(results).blocks if block.kind == kind]


def effects(results: LoopResults) -> list[tuple[tuple[str, str], ...]]:
    """(text, mark) of each cell of the first screen's effects."""
    rows = [row for block in of(results, "pairs") for row in block.rows]
    return [tuple((getattr(c, "text", c), getattr(c, "mark", "")) for c in row) for row in rows]  # type: ignore[misc]


def plain(text: str) -> str:
    return text.replace("\u00a0", " ")


def without(results: LoopResults, **changed: Any) -> LoopResults:
    return replace(results, rounds=(replace(results.rounds[0], **changed),))


def test_each_sealed_effect_stands_beside_what_was_found_with_its_share() -> None:
    friction, delay, law, false = effects(won_back())
    assert plain(friction[0][0]) == "coulomb friction, L knee: 1.2 N m"
    assert (
        plain(friction[1][0]) == "1.15 [1.05, 1.25] N m (−4.2 %, interval holds it)" and plain(friction[2][0]) == "71 %"
    )
    assert delay[1][1] == "flagged" and "depending on target, velocity" in delay[1][0]
    assert "outside the catalogue" in law[0][0] and law[1][1] == "found" and "sin(12*q)" in law[1][0]
    assert false[0] == ("not sealed", "missed") and "kd, L elbow" in false[1][0]


def test_what_is_neither_found_nor_flagged_is_said_to_be_missed() -> None:
    results = won_back([LAW], [])
    ((_, told, share),) = effects(results)
    assert told == ("not found", "missed") and share[0] == "–"
    assert "1 effect of the stand-in robot was not in its model; 0 found." in headline(results)


def test_the_headline_counts_and_climbs() -> None:
    said = plain(headline(won_back()))
    assert "3 effects" in said and "2 found, 1 flagged, 1 reported that is not there" in said
    assert "28 % before, 61 % compensated, 86 % refined; on the declared model 92 %" in said


def test_success_is_shown_before_compensated_refined_and_for_the_controls() -> None:
    results = won_back()
    steps = {s.called: s for s in success_steps(results.evaluation, results.rounds[0], "base (shipped)")}
    assert list(steps)[:4] == ["base (shipped)", "before", "compensated", "refined"]
    assert steps["compensated"].declared is None and steps["refined"].robot["value"] == 0.86  # type: ignore[index]
    assert [s.called for s in steps.values() if s.control] == ["control: declared model", "control: delta alone"]
    (bars,) = of(results, "bars")
    assert bars.header == ("on the robot", "on the declared model") and len(bars.bars) == len(steps)
    gains = step_differences(results.evaluation, results.rounds[0])
    assert gains[0].startswith("compensated against before: +33 points [+16, +50]")
    assert any(line.startswith("refined against control: delta alone") for line in gains)


def test_rows_that_were_not_evaluated_are_left_out() -> None:
    made = won_back()
    some = [e for e in made.evaluation["results"] if e["policy"] in ("experts-r0", "experts-r1")]
    results = replace(made, evaluation={**made.evaluation, "results": some})
    assert [s.called for s in success_steps(results.evaluation, made.rounds[0], "base")] == ["before", "refined"]
    assert "compensated" not in headline(results)
    assert step_differences(results.evaluation, made.rounds[0]) == [
        "refined against before: +58 points [+41, +75], p = 0.0004: better"
    ]


def test_experts_that_are_the_shipped_file_have_no_row_beside_it() -> None:
    made = won_back()
    same = [{**c, "unchanged": (c["from"], c["to"]) == ("base", "experts-r0")} for c in made.evaluation["comparisons"]]
    steps = success_steps({**made.evaluation, "comparisons": same}, made.rounds[0], "base (shipped)")
    assert steps[0].called == "before" and steps[0].note == "the same file as base (shipped)"


def untouched(results: LoopResults) -> LoopResults:
    """Nothing compensated, no delta kept, the refined experts the same files as before."""
    same = [{**c, "unchanged": c["to"] == "experts-r1"} for c in results.evaluation["comparisons"]]
    return without(replace(results, evaluation={**results.evaluation, "comparisons": same}), compensation=None)


def test_a_null_seal_that_changes_nothing_is_told_in_one_sentence() -> None:
    flagged = untouched(won_back([], []))
    assert "nothing was named, but structure was wrongly flagged; nothing was changed" in headline(flagged)
    left = {"significant": False, "p": 0.4, "where": [], "depends_on": [], "description": ""}
    results = without(flagged, diagnosis={**flagged.rounds[0].diagnosis, "unexplained": left})
    assert headline(results) == "Nothing was undeclared; nothing was found; nothing was changed."
    assert effects(results) == []


@pytest.mark.parametrize(
    ("reported", "said"),
    [([], "wrongly flagged; changed nevertheless: 1 compensation set, experts trained on."),
     ([found()], "wrongly found: coulomb friction, L knee 1.15 [1.05, 1.25] N m. Changed on that ground:")],
)  # fmt: skip
def test_a_null_seal_that_did_something_says_what(reported: list[dict[str, Any]], said: str) -> None:
    assert said in plain(headline(won_back([], reported)))


def test_a_null_seal_wrongly_explained_but_left_alone_says_both() -> None:
    assert plain(headline(untouched(won_back([], [found()])))).endswith("N m. Nothing was changed.")


def test_a_real_robot_has_no_seal_no_robot_column_and_no_success_of_its_own() -> None:
    results = replace(won_back(), sealed=None)
    assert "3 effects found that the declared model of your robot lacks" in headline(results)
    (bars,) = of(results, "bars")
    assert bars.header == ("", "on the declared model") and all(bar.robot is None for bar in bars.bars)
    assert "compensated" not in {bar.called for bar in bars.bars}
    assert all(len(row) == 2 for row in effects(results))
    assert not any("on the robot" in line for line in opening_lines(results))


def test_a_loop_without_rounds_opens_with_what_its_last_policy_does() -> None:
    results = replace(won_back(), rounds=())
    assert headline(results).startswith("No round with the robot. Generalist on the stand-in robot: 83 % [70, 96]")
    assert opening_lines(results) == [headline(results)]


def test_the_terminal_says_the_same() -> None:
    lines = [plain(line) for line in opening_lines(won_back())]
    assert lines[0] == plain(headline(won_back()))
    assert any(line.startswith("coulomb friction, L knee: 1.2 N m -> 1.15") and "71 %" in line for line in lines)
    assert any("mrad with the declared model" in line for line in lines)
    assert "compensated: 61 % [48, 74] on the robot" in lines
    assert any(line.startswith("refined against before") for line in lines)


def test_what_was_undone_at_the_joint_is_one_line_above_and_a_table_below() -> None:
    assert compensation_line(PLAN).endswith("1 of 2; left: command delay, R hip pitch.")
    assert compensation_line(None) == "" and compensation_table({"plan": []}) == []
    (table,) = compensation_table(PLAN)
    assert table.rows[0][2] == "torque along the speed asked for; 1.15 N m"
    assert table.rows[1][1:] == ("left", "14 ms are more than the reference can be read ahead")
    made = page_of(won_back())
    beside = [made.index(f"{title}</h3>") for title in ("simulator lacked", "without training", "before and after")]
    assert beside == sorted(beside)


def test_rollouts_that_came_over_a_wire_are_said_to_and_its_latency_is_no_false_alarm() -> None:
    late = {**DELAY, "where": [], "parameters": {"delay": 0.008}}
    value = {"delay": {"value": 0.0075, "ci95": [0.0065, 0.0085], "unit": "s"}}
    delay = {**found("command_delay"), "where": [], "parameters": value}
    made = replace(won_back([late], [delay]), wire=0.008)
    assert [mark for _, mark in effects(made)[0]] == ["", "found", ""]
    assert any("8.0 ms from a state's stamp" in line for line in opening_lines(made))
    assert "came over a wire" in page_of(made) and "came over a wire" not in page_of(won_back())


def test_an_effect_that_was_found_by_name_is_not_taken_for_a_law_without_one() -> None:
    law = {**found("discovered"), "parameters": {"terms": [{"term": "sign(v)", "coefficient": 1.0}]}}
    (first, second) = effects(won_back([TRUTH], [law, found()]))
    assert "interval holds it" in first[1][0] and second[0][0] == "not sealed"


def test_an_interval_of_a_difference_that_is_missing_is_no_claim() -> None:
    few = {**difference(0.5, 0.1, 1.0), "ci95": [None, None]}
    made = won_back()
    changed = [{**c, "success": few} for c in made.evaluation["comparisons"]]
    lines = step_differences({**made.evaluation, "comparisons": changed}, made.rounds[0])
    assert all(line.endswith("too few motions for an interval") for line in lines)


def test_each_parameter_of_a_sealed_effect_has_its_own_unit() -> None:
    inside = {"effect": "stribeck_friction", "where": [], "parameters": {"stiction": 1.0, "velocity": 0.2}, "unit": "x"}
    assert plain(sealed_size(inside)) == "stiction 1 N m, velocity 0.2 rad/s"
    beyond = {"effect": "sticky_gear", "where": [], "parameters": {"torque": 2, "width": 0.1}, "unit": "N m, rad"}
    assert plain(sealed_size(beyond)) == "torque 2 N m, width 0.1 rad"
    alone = {"effect": "sticky_gear", "where": [], "parameters": {"torque": 2, "teeth": 9}, "unit": "N m"}
    assert plain(sealed_size(alone)) == "torque 2 N m, teeth 9"


@pytest.mark.parametrize(
    ("zz", "told"),
    [([0.037, 0.041], "(+2.0 %, interval holds it)"), ([0.037, 0.039], "(+2.0 %, zz outside the interval)")],
)
def test_every_parameter_is_held_against_its_own_interval(zz: list[float], told: str) -> None:
    place = {"effect": "link_inertia", "where": ["pelvis"]}
    found = {"xx": {"value": 0.051, "ci95": [0.04, 0.06]}, "zz": {"value": 0.038, "ci95": zz}}
    (row,) = match([place | {"parameters": {"xx": 0.05, "zz": 0.0396}}], [place | {"parameters": found}])
    assert row.told.strip() == told
