"""Every step is told in all three measures, in words; what came along is told apart from what the loop taught."""

import re
from dataclasses import replace
from importlib import import_module
from typing import Any

import pytest

from bumblebee.report.names import everyone, label, ladder, last_policy
from bumblebee.report.results import LoopResults
from bumblebee.report.sections.next_steps import next_steps, price
from bumblebee.report.sections.opening import opening, opening_lines
from bumblebee.report.sections.policy_sections import registry_section, success_section
from bumblebee.report.wording import SAME_FILE, change, changes
from tasks.settings.params import SECTIONS
from tests.report.made import TRUTH, difference, found, loop_results, won_back


def told(results: LoopResults) -> dict[str, list[tuple[str, ...]]]:
    """Rows of each table in the success section, by the table's name."""
    blocks = success_section(results).blocks
    return {b.title: [tuple(str(cell) for cell in row) for row in b.rows] for b in blocks if b.kind == "table"}


def with_step(**more: Any) -> LoopResults:
    made = loop_results([found()], [TRUTH])
    changed = [{**c, **more} for c in made.evaluation["comparisons"]]
    return replace(made, evaluation={**made.evaluation, "comparisons": changed})


def test_a_round_that_makes_joint_errors_worse_is_said_beside_equal_success() -> None:
    results = with_step(
        success=difference(0.0, 0.1, 1.0), mpjpe_rad=difference(0.004, 0.001, 0.01), mpkpe_mm=difference(-8, 3, 0.02)
    )
    row = told(results)["steps of the loop"][0]
    assert row[-3].endswith("no difference shown")
    assert row[-2] == "+4.0 mrad [+3.0, +5.0], p = 0.01: worse"
    assert row[-1].endswith("mm [−11.0, −5.0], p = 0.02: better")


def test_a_file_is_not_compared_with_itself() -> None:
    results = with_step(unchanged=True)
    assert all(row[-3:] == (SAME_FILE, "–", "–") for row in told(results)["steps of the loop"])
    assert changes({"unchanged": True, "success": difference(0, 0, 1)}) == SAME_FILE


def test_a_difference_without_pairs_says_so() -> None:
    nothing = {"value": None, "ci95": [None, None], "p": None, "motions": 0}
    assert change({"mpjpe_rad": nothing}, "mpjpe_rad") == "no episode that both followed"
    assert change({"success": nothing}) == "not comparable"


@pytest.mark.parametrize(
    ("began", "trained_on", "called"),
    [
        ("shipped", False, "base (shipped)"),
        ("shipped", True, "base (shipped, trained on)"),
        ("own", False, "base (own)"),
        ("scratch", False, "base"),
    ],
)
def test_what_came_along_is_told_apart_in_every_table(began: Any, trained_on: bool, called: str) -> None:
    results = replace(loop_results([found()], [TRUTH]), began=began, base_trained_on=trained_on)
    tables = told(results)
    rates = tables["success on the stand-in robot"]
    assert called in {row[0] for row in rates} and ("base" in {row[0] for row in rates}) == (called == "base")
    gains = {row[0]: row[4] for row in rates if row[1] == "training"}
    assert gains["generalist"] != "–" and gains[called] == "–"
    assert any(row[0].startswith(f"{called} →") for row in tables["steps of the loop"])
    assert registry_section(results).blocks[0].rows[0][0] == called


def test_a_refined_policy_that_is_worse_on_the_declared_model_is_said_on_the_first_screen() -> None:
    made = won_back()
    said = price(made, made.rounds[0])
    assert said.startswith("The price: on the declared model") and "+4.0 mrad [+3.0, +5.0], p = 0.01" in said
    assert opening(made).blocks[0].text == said and opening_lines(made)[1] == said
    better = [{**c, "mpjpe_rad": difference(-0.004, 0.001, 0.01)} for c in made.evaluation["comparisons"]]
    assert price(replace(made, evaluation={**made.evaluation, "comparisons": better}), made.rounds[0]) == ""


@pytest.mark.parametrize("learner", ["ppo", "world_model"])
def test_what_still_fails_is_said_with_a_key_of_params_yaml_that_is_there(learner: str) -> None:
    lost, unnamed = next_steps(replace(won_back(), learners={"expert-c0 r0": "ppo", "expert-c0 r1": learner}))
    assert "walk 83 % of 36 motions" in lost and "command delay" in unnamed
    keys = [key for line in (lost, unnamed) for key in re.findall(r"raise (\S+) in params.yaml", line)]
    assert keys == [f"refine.{learner}.iterations", "rollouts.repeats"]
    for key in keys:
        section, *names = key.split(".")
        module, name_of = SECTIONS[section].split(":")
        config: Any = getattr(import_module(module), name_of)()
        for name in names:
            config = getattr(config, name)
        assert isinstance(config, int)


def test_the_chart_of_steps_shows_one_dot_a_step_and_says_what_it_proves() -> None:
    charts = [block for block in success_section(won_back()).blocks if block.kind == "strips"]
    rows = {strip.called: strip for strip in charts[0].strips}
    won = rows["experts-r0 → experts-r1"]
    assert [mark.tone for mark in won.marks if mark.shape == "dot"] == ["good"] and won.words == "+58"
    lost = rows["experts-r1 → generalist"]
    assert [mark.tone for mark in lost.marks if mark.shape == "dot"] == ["even"] and "no difference shown" in lost.tip
    assert all(
        0 <= mark.left <= 100 and mark.left + mark.width <= 100.01 for row in rows.values() for mark in row.marks
    )
    folded = [b.folded for b in success_section(won_back()).blocks if b.title == "steps of the loop"]
    assert folded == ["All comparisons, all measures"]


def test_the_grid_has_a_row_for_each_policy_with_its_whole_name() -> None:
    made = loop_results([found()], [TRUTH])
    grid = next(b for b in success_section(made).blocks if b.title == "success by family")
    assert [row[0] for row in grid.rows] == [label(made, policy) for policy in everyone(made)]
    last: Any = grid.rows[-1][1]
    assert (last.text, last.shade) == ("90", 0.9) and "90 % [80, 100] of 9 motions" in last.tip


def test_controls_stand_beside_their_round_and_are_no_step_of_the_loop() -> None:
    made = loop_results([found()], [TRUTH])
    names = ["experts-r10", "control-delta-r1", "experts-r0-compensated", "base", "experts-r1", "experts-r0"]
    results = replace(made, evaluation={**made.evaluation, "results": [{"policy": name} for name in names]})
    assert ladder(results) == ["base", "experts-r0", "experts-r0-compensated", "experts-r1", "experts-r10"]
    assert everyone(results)[3:5] == ["experts-r1", "control-delta-r1"]
    assert last_policy(results) == "experts-r10"
    assert label(results, "control-delta-r1") == "control r1: delta alone"
    assert label(results, "experts-r0-compensated") == "experts-r0, compensated"
