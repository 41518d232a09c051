"""A policy becomes champion unless it is shown to be worse, or cannot be compared with the one that is."""

import pytest

from bumblebee.evaluation.intervals import wilson
from tasks.approvals.promotion.rule import Verdict, against_champion, against_parent, both, unchanged

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


@pytest.mark.parametrize("trials", [1, 3, 10, 29, 36, 263])
def test_an_equal_policy_is_never_refused_as_worse(trials: int):
    """Not by an interval that ends a rounding error below its own value, nor by the six digits of a tag."""
    for rate in (1.0, 2 / 3, 0.12345678, 0.0):
        champion = TAGS | {"success": f"{rate:.6g}"}
        for high in (rate, rate - 1e-16, wilson(rate * trials, trials)[1], None):
            now = {"value": rate, "ci95": [0.0, high]}
            assert against_champion(now, champion, "abc", "nominal").promoted
    assert against_parent(difference(0.0, -1e-16, -1e-17, 0.01)).promoted


def test_an_unchanged_policy_says_so_and_is_no_objection():
    verdict = unchanged("base")
    assert verdict.promoted and verdict.reason == "unchanged: the same file as its parent base"


def test_a_champion_of_the_same_file_stays_and_gives_way_only_to_newer_numbers():
    """Within one evaluation the alias has nowhere better to go; in another one the same file brings its numbers."""
    now, champion = {"value": 0.5, "ci95": [0.3, 0.7]}, TAGS | {"onnx_sha256": "f00"}
    stays = against_champion(now, champion, "abc", "nominal", onnx_sha256="f00")
    assert not stays.promoted and "same file" in stays.reason and "0.9" not in stays.reason
    moves = against_champion(now, champion, "new", "nominal", onnx_sha256="f00")
    assert moves.promoted and "same file" in moves.reason
    assert "same file" not in against_champion(now, champion, "abc", "nominal", onnx_sha256="bar").reason
    assert "same file" not in against_champion(now, TAGS, "abc", "nominal").reason


def test_one_objection_is_enough_and_all_reasons_are_kept():
    assert both(Verdict(True, "a"), Verdict(False, "b")) == Verdict(False, "a; b")
