"""A policy becomes champion unless it is worse by more than its interval allows."""

import pytest

from tasks.promotion import Verdict, against_champion, against_parent, both


def difference(value: float | None, low: float | None, high: float | None) -> dict:
    return {"success": {"value": value, "ci95": [low, high]}}


@pytest.mark.parametrize(
    ("value", "low", "high", "promoted"),
    [(0.1, 0.0, 0.2, True), (-0.1, -0.2, 0.05, True), (-0.2, -0.3, -0.1, False), (0.0, None, None, True),
     (-0.5, None, None, False), (None, None, None, True)],
)  # fmt: skip
def test_a_child_holds_unless_the_whole_interval_lies_below_zero(
    value: float | None, low: float | None, high: float | None, promoted: bool
):
    assert against_parent(difference(value, low, high)).promoted is promoted


def test_without_a_parent_it_holds():
    assert against_parent(None).promoted


def test_the_champion_stays_when_even_the_upper_end_is_below_it():
    tags = {"success": "0.9", "evaluation_contract": "abc"}
    assert not against_champion({"value": 0.5, "ci95": [0.3, 0.7]}, tags, "abc").promoted
    assert against_champion({"value": 0.85, "ci95": [0.7, 0.95]}, tags, "abc").promoted


def test_numbers_under_another_contract_do_not_count():
    tags = {"success": "0.9", "evaluation_contract": "old"}
    assert against_champion({"value": 0.1, "ci95": [0.0, 0.2]}, tags, "new").promoted
    assert against_champion({"value": 0.1, "ci95": [0.0, 0.2]}, None, "new").promoted


def test_one_objection_is_enough_and_all_reasons_are_kept():
    assert both(Verdict(True, "a"), Verdict(False, "b")) == Verdict(False, "a; b")
