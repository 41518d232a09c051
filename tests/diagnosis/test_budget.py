"""A soft time limit: running steps finish, skipped ones are listed, and what is left is flagged all the same."""

import time

import pytest

from bumblebee.diagnosis.budget import Budget
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.diagnose import diagnose
from tests.diagnosis import cart


def test_what_has_no_time_is_written_down_once() -> None:
    now = [5.0]
    budget = Budget(10.0, clock=lambda: now[0])
    assert budget.has_time_for("a law on a") and not budget.notes()
    now[0] = 15.5
    assert not budget.has_time_for("a law on b") and not budget.has_time_for("a law on b")
    assert not budget.has_time_for("a law on c")
    (note,) = budget.notes()
    assert note.endswith("not tried: a law on b; a law on c") and "10 s" in note


def test_the_note_says_which_search_was_cut_and_by_what_setting() -> None:
    now = [0.0]
    budget = Budget(60.0, "among the catalogue's effects", "search_seconds", clock=lambda: now[0])
    now[0] = 61.0
    assert not budget.has_time_for("more effects")
    (note,) = budget.notes()
    ended = "the search among the catalogue's effects ended at its limit of 60 s of processor time"
    assert note == f"{ended} (`search_seconds`); not tried: more effects"


def test_what_cut_a_search_is_said_though_the_other_limit_comes_later() -> None:
    now, over = [0.0], [False]
    budget = Budget(60.0, clock=lambda: now[0], over=lambda effects: over[0])
    now[0] = 61.0
    assert not budget.has_time_for("more effects")
    over[0] = True
    assert "60 s of processor time" in budget.notes()[0]
    early = Budget(60.0, clock=lambda: 0.0, over=lambda effects: True)
    assert not early.has_time_for("more effects") and "`--minutes` or a signal" in early.notes()[0]


def test_time_in_which_others_work_does_not_count() -> None:
    assert Budget().clock is time.process_time


def test_a_search_without_time_ends_and_says_so() -> None:
    made = cart.session(cart.record(cubic=0.6))
    few = {"max_windows": 30, "max_holdout_windows": 15, "report_windows": 6, "grow": False, "beyond": False}
    found = diagnose(made, DiagnosisConfig(**few, search_seconds=0.0)).document
    assert not found["effects"]
    assert [note for note in found["notes"] if "search_seconds" in note and "more effects" in note]


def test_without_a_limit_there_is_always_time() -> None:
    assert Budget().has_time_for("anything") and not Budget().notes()


@pytest.mark.parametrize("seconds", [0.0, 1e9])
def test_a_search_without_time_flags_the_joint_and_names_no_form(seconds: float) -> None:
    """A spring of third order on the pole: without time only its joint is said, and that no law was sought.

    Nothing of the catalogue is tried before, which would cost most of the time and name no law of third order.
    """
    made = cart.session(cart.record(cubic=0.6))
    few = {"max_windows": 30, "max_holdout_windows": 15, "report_windows": 6, "grow": False}
    config = DiagnosisConfig(**few, search_seconds=0.0, beyond_seconds=seconds)
    found = diagnose(made, config).document
    cut = [note for note in found["notes"] if "beyond_seconds" in note]
    forms = [e["where"] for e in found["effects"] if e["effect"] == "discovered"]
    if seconds:
        assert not cut and forms == [["pole"]]
    else:
        assert len(cut) == 1 and "pole" in cut[0] and not forms
        assert found["unexplained"]["significant"] and "pole" in found["unexplained"]["where"]
