"""An error at or below the noise floor is never told without what that means."""

import pytest

from bumblebee.report import noise_floor
from bumblebee.report.held_out import error_line
from bumblebee.report.sections.opening import opening_lines
from tests.report.made import TRUTH, block, found, loop_results

FLOOR = {"value": 4.39, "ci95": [3.0, 5.0]}
MEASURES = ["joint_pos_rmse"]


@pytest.mark.parametrize(
    ("value", "said"),
    [(3.25, "no more than sensor noise explains"), (4.8, "no more than sensor noise explains"),
     (2.0, "less than the floor's interval"), (6.0, "")],
)  # fmt: skip
def test_what_an_error_beside_its_floor_means(value: float, said: str) -> None:
    meaning = noise_floor.meaning({"value": value, "ci95": None}, FLOOR)
    assert meaning.startswith(said) and bool(meaning) == bool(said)


def test_nothing_is_said_without_a_floor() -> None:
    assert noise_floor.meaning({"value": 1.0, "ci95": None}, None) == ""
    assert noise_floor.summary({"after": block(0.01)}, MEASURES) == ""


def test_the_first_screen_explains_an_error_below_the_floor_and_shows_the_floors_interval() -> None:
    results = loop_results([found()], [TRUTH])
    results.rounds[0].diagnosis["error"] |= {"after": block(0.00325), "floor": block(0.0034)}
    line = error_line(results.rounds[0])
    assert "noise floor 3.40 [3.06, 3.74] mrad (no more than sensor noise explains)" in line
    assert any("noise floor 3.40 [3.06, 3.74]" in line for line in opening_lines(results))


def test_errors_below_the_floor_are_counted_in_one_sentence_that_says_what_it_means() -> None:
    inside = noise_floor.summary({"after": block(0.0095), "floor": block(0.01)}, MEASURES)
    assert "1 error, 1 lies below the floor, within its interval: no more than sensor noise explains" in inside
    below = noise_floor.summary({"after": block(0.005), "floor": block(0.01)}, MEASURES)
    assert "1 of them below its interval: the sensors are less noisy" in below
