"""Asking for more at a gate: the round waits on, approvals of before count no more, and other data ask everybody."""

import json
import multiprocessing
import os
from pathlib import Path
from typing import Any

import pytest

from bumblebee.errors import BadInput
from tasks.approvals import gate, ledger, words
from tests.tasks.approvals.test_gate_people import TWO, person, write

WISH = "walks on the wet floor"


@pytest.fixture
def place(tmp_path: Path) -> gate.Gate:
    made = gate.Gate(tmp_path, 1)
    write(made, 4)
    return made


def say(place: gate.Gate, verb: str, login: str, people: int = 1, **more: Any) -> dict[str, Any]:
    seen = gate.request(place, people=people)["seen"]["sha256"]
    note = {"note": WISH} if verb == "more" else {}
    return gate.decide(place, verb, person(login), seen, rule=gate.GateConfig(people=people), **note, **more)


def record(place: gate.Gate) -> list[dict[str, Any]]:
    return [entry["answer"] for entry in ledger.check(place.approval.parent)]


def test_the_round_waits_on_and_says_who_asked_for_what_and_how_it_goes_on(place: gate.Gate) -> None:
    table = say(place, "more", "ann")
    assert gate.verdict(place) == table["status"] == "more" and gate.request(place) == table
    assert gate.settle(place, False) == gate.settle(place, True) == table  # nor does it answer itself
    (line,) = record(place)
    assert (line["status"], line["known_by"]["user"], line["note"]) == ("more", "ann", WISH)
    assert line["seen"] == table["seen"]
    told = words.how_to_answer(place.workspace, table)
    assert f"more asked for by Ann (unix user ann, uid 1000, on lab) at {table['at']}: {WISH}" in told
    assert "add rollouts and start again" in told and told.count("\n") == 0


def test_what_is_wanted_must_be_said(place: gate.Gate) -> None:
    seen = gate.request(place)["seen"]["sha256"]
    with pytest.raises(BadInput, match="--note: expected what is wanted, came nothing"):
        gate.decide(place, "more", person("ann"), seen, " \n")
    assert gate.verdict(place) == "pending" and record(place) == []


def test_more_data_ask_everybody_again_and_the_request_is_history(place: gate.Gate) -> None:
    say(place, "more", "ann")
    write(place, 9)
    asked = gate.request(place)
    assert asked["status"] == "pending" and [(old["status"], old["note"]) for old in asked["history"]] == [
        ("more", WISH)
    ]
    assert say(place, "approve", "bob")["status"] == "approved"


@pytest.mark.parametrize("verb", ["approve", "reject", "more"])
def test_who_comes_second_is_told_and_changes_it_only_by_saying_so(place: gate.Gate, verb: str) -> None:
    say(place, "more", "ann")
    with pytest.raises(BadInput, match=rf"round 1: .*more asked for by Ann .*: {WISH}.*{verb} .*--change"):
        say(place, verb, "bob")
    table = say(place, verb, "bob", change=True)
    assert table["status"] == gate.ANSWERS[verb] and [old["status"] for old in table["history"]] == ["more"]
    assert [one["status"] for one in record(place)] == ["more", gate.ANSWERS[verb]]


def test_more_asked_for_after_an_answer_takes_the_word_change_too(place: gate.Gate) -> None:
    say(place, "approve", "ann")
    with pytest.raises(BadInput, match=r"approved by Ann .*more .*--change"):
        say(place, "more", "bob")
    assert say(place, "more", "bob", change=True)["status"] == "more" == gate.verdict(place)


def test_of_two_people_an_approval_of_before_counts_no_more_and_both_approve_again(place: gate.Gate) -> None:
    assert say(place, "approve", "ann", 2)["status"] == "pending"
    asked = say(place, "more", "bob", 2)
    assert asked["status"] == "more" and "approvals" not in asked
    assert [(old["status"], old["by"]) for old in asked["history"]] == [("approved", "Ann")]
    with pytest.raises(BadInput, match="more asked for by Bob"):
        say(place, "approve", "cyd", 2)
    assert say(place, "approve", "cyd", 2, change=True)["status"] == "pending"
    with pytest.raises(BadInput, match="a second one by cyd"):
        say(place, "approve", "cyd", 2)
    table = say(place, "approve", "bob", 2)  # who changed their mind
    assert table["status"] == "approved" == gate.verdict(place, people=2)
    assert [one["by"] for one in table["approvals"]] == ["Cyd"]
    assert [old["status"] for old in table["history"]] == ["approved", "more"]


def test_who_may_not_answer_may_not_ask_for_more(place: gate.Gate) -> None:
    seen = gate.request(place, people=2)["seen"]["sha256"]
    page = gate.Author("Ann", {"how": "Prefect's page"})
    with pytest.raises(BadInput, match="a login of their own"):
        gate.decide(place, "more", page, seen, WISH, rule=TWO)


def one_answer(place: gate.Gate, number: int, seen: str, start: Any, told: Any) -> None:
    start.wait()
    try:
        gate.decide(place, "more" if number % 2 else "approve", person(f"p{number}"), seen, WISH)
        told.put((number, ""))
    except BadInput as error:
        told.put((number, str(error)))


def test_of_many_at_once_one_wins_and_the_others_are_told_by_whom(place: gate.Gate) -> None:
    fork = multiprocessing.get_context("fork")
    seen, start, told = str(gate.request(place)["seen"]["sha256"]), fork.Barrier(12), fork.Queue()
    started = [fork.Process(target=one_answer, args=(place, n, seen, start, told)) for n in range(12)]
    for process in started:
        process.start()
    got = dict(told.get(timeout=60) for _ in started)
    for process in started:
        process.join()
    (winner,) = [number for number, said in got.items() if not said]
    assert all(f"by P{winner} " in said for number, said in got.items() if number != winner)
    assert [one["by"] for one in record(place)] == [f"P{winner}"]


@pytest.mark.parametrize(("verb", "people"), [("more", 1), ("reject", 1), ("approve", 1), ("approve", 2), ("more", 2)])
def test_an_answer_counts_once_it_stands_in_the_record_though_a_kill_came_then(
    place: gate.Gate, verb: str, people: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed between the record and the request's own file."""
    say(place, "approve", "cyd", 2) if people == 2 else gate.request(place)
    fork = multiprocessing.get_context("fork")

    def killed() -> None:
        monkeypatch.setattr(gate, "write_json", lambda path, table: os._exit(9))
        say(place, verb, "ann", people)

    process = fork.Process(target=killed)
    process.start()
    process.join(60)
    assert process.exitcode == 9 and json.loads(place.approval.read_text())["status"] == "pending"
    table = gate.request(place, people=people)
    assert (table["status"], table["by"]) == (gate.ANSWERS[verb], "Ann")
    assert json.loads(place.approval.read_text()) == table
    with pytest.raises(BadInput, match=r"by .*Ann"):
        say(place, "approve", "bob", people)


def test_approvals_of_data_that_came_back_do_not_count(place: gate.Gate) -> None:
    """The record has them; the others were asked about other data in between."""
    say(place, "approve", "ann", 2)
    write(place, 5)
    gate.request(place, people=2)
    write(place, 4)
    table = gate.request(place, people=2)
    assert table["status"] == "pending" and not table.get("approvals")
    assert say(place, "approve", "bob", 2)["status"] == "pending"


def test_answers_at_gates_of_several_rounds_at_once_leave_the_record_whole(place: gate.Gate) -> None:
    places = [gate.Gate(place.workspace, number) for number in range(1, 9)]
    for one in places:
        write(one, 4)
        gate.request(one)
    fork = multiprocessing.get_context("fork")
    start, told = fork.Barrier(len(places)), fork.Queue()
    seen = [str(one.sha256()) for one in places]
    started = [
        fork.Process(target=one_answer, args=(one, one.round, sha, start, told))
        for one, sha in zip(places, seen, strict=True)
    ]
    for process in started:
        process.start()
    assert [told.get(timeout=60)[1] for _ in started] == [""] * len(places)
    for process in started:
        process.join()
    assert sorted(one["round"] for one in record(place)) == list(range(1, 9))
