"""Answers from Prefect's page under personal logins: each counts once, and the run is resumed by what stands."""

from pathlib import Path

import pytest

from flows.gates.page_answer import answer
from flows.people.accounts import Person
from tasks.approvals import gate
from tests.flows.gates.test_gate_answer import waiting

ANN, BOB = Person("ann", ("leads",), "", ""), Person("bob", (), "", "")


@pytest.fixture
def place(tmp_path: Path) -> gate.Gate:
    return waiting(tmp_path / "lab", 3)


def given(place: gate.Gate, verb: str = "approve", **more: object) -> dict[str, object]:
    """Content of the form."""
    return {"answer": verb, "by": "", "seen": gate.seen_of(place.summary)["sha256"][:12], "note": "", **more}


def test_an_answer_resumes_the_run_and_stands_under_the_name_of_the_login(place: gate.Gate) -> None:
    assert answer(place, given(place), ANN) == (None, False)
    table = gate.read_approval(place.approval)
    assert (table["by"], table["known_by"]) == ("ann", gate.personal("ann", ("leads",)))


def test_sent_again_it_resumes_the_run_again_and_counts_once(place: gate.Gate) -> None:
    for _ in range(2):
        assert answer(place, given(place), ANN) == (None, False)
    assert gate.read_approval(place.approval)["history"] == []


def test_another_answer_is_told_of_the_first_and_the_run_does_not_wait_on(place: gate.Gate) -> None:
    answer(place, given(place), ANN)
    for who, verb in ((BOB, "approve"), (ANN, "reject")):
        said, waits = answer(place, given(place, verb), who)
        assert said is not None and "already approved by ann (personal login ann)" in said and not waits
    assert gate.read_approval(place.approval)["status"] == "approved"


def test_a_first_of_two_approvals_is_kept_and_the_run_waits(place: gate.Gate) -> None:
    (place.workspace / "params.yaml").write_text("gate: {mode: ask, people: 2}\n")
    said, waits = answer(place, given(place), ANN)
    assert said is not None and "your answer is kept" in said and waits
    said, waits = answer(place, given(place), ANN)
    assert said is not None and "a second one by ann" in said and waits
    assert answer(place, given(place), BOB) == (None, False)


@pytest.mark.parametrize(
    "wrong",
    [{"answer": "yes"}, {"answer": None}, {"answer": ["approve"]}, {"seen": "f" * 12}, {"seen": 3}, {"answer": "more"}],
)
def test_what_is_no_answer_is_said_and_the_run_waits(place: gate.Gate, wrong: dict[str, object]) -> None:
    said, waits = answer(place, given(place) | wrong, ANN)
    assert said is not None and "expected" in said and waits
    assert gate.request(place)["status"] == "pending"


def test_only_the_group_answers_where_one_is_named(place: gate.Gate) -> None:
    (place.workspace / "params.yaml").write_text("gate: {mode: ask, group: leads}\n")
    said, waits = answer(place, given(place), BOB)
    assert said is not None and "a member of the group leads" in said and waits
    assert answer(place, given(place), ANN) == (None, False)
