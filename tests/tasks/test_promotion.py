"""A policy becomes champion unless it is shown to be worse, or cannot be compared with the one that is."""

import pytest

from tasks.promotion import Verdict, against_champion, against_parent, both

TAGS = {"success": "0.9", "evaluation_contract": "abc", "evaluation_engine": "nominal"}


def difference(value: float | None, low: float | None, high: float | None, p: float | None) -> dict:
    return {"success": {"value": value, "ci95": [low, high], "p": p}}


@pytest.mark.parametrize(
    ("value", "low", "high", "p", "promoted"),
    [(0.1, 0.0, 0.2, 0.1, True), (-0.1, -0.2, 0.05, 0.04, True), (-0.2, -0.3, -0.1, 0.05, False),
     (-1.0, -1.0, -1.0, 0.5, True), (-0.5, None, None, 1.0, True), (None, None, None, None, True)],
)  # fmt: skip
def test_a_child_holds_unless_interval_and_test_show_that_it_is_worse(
    value: float | None, low: float | None, high: float | None, p: float | None, promoted: bool
):
    assert against_parent(difference(value, low, high, p)).promoted is promoted


def test_without_a_parent_it_holds():
    assert against_parent(None).promoted


def test_the_champion_stays_when_even_the_upper_end_is_below_it():
    assert not against_champion({"value": 0.5, "ci95": [0.3, 0.7]}, TAGS, "abc", "nominal").promoted
    assert against_champion({"value": 0.85, "ci95": [0.7, 0.95]}, TAGS, "abc", "nominal").promoted


@pytest.mark.parametrize(("contract", "engine"), [("new", "nominal"), ("abc", "stand_in")])
def test_a_champion_that_cannot_be_compared_stays_until_a_person_says_otherwise(contract: str, engine: str):
    better = {"value": 1.0, "ci95": [0.9, 1.0]}
    kept = against_champion(better, TAGS, contract, engine)
    assert not kept.promoted and "publish.replace_incomparable: true" in kept.reason
    assert against_champion(better, TAGS, contract, engine, replace_incomparable=True).promoted


def test_the_first_version_is_champion_whatever_its_numbers():
    assert against_champion({"value": 0.1, "ci95": [0.0, 0.2]}, None, "abc", "nominal").promoted


def test_one_objection_is_enough_and_all_reasons_are_kept():
    assert both(Verdict(True, "a"), Verdict(False, "b")) == Verdict(False, "a; b")
