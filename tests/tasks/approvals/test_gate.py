"""The gate: an answer binds to what was seen, says how its author was known, and is never replaced in silence."""

import json
import multiprocessing
import os
import re
from pathlib import Path
from typing import Any

import pytest

from bumblebee.errors import BadInput
from tasks.approvals import gate

ANN, BOB = gate.unix_user("Ann"), gate.unix_user("Bob")


@pytest.fixture
def place(tmp_path: Path) -> gate.Gate:
    made = gate.Gate(tmp_path, 1)
    write(made, 4)
    return made


def write(place: gate.Gate, accepted: int) -> None:
    place.summary.parent.mkdir(parents=True, exist_ok=True)
    counts = {"accepted": accepted, "quarantined": 1, "seconds": 8.0, "by_rule": {"gap": {"files": 1}}}
    place.summary.write_text(json.dumps(counts))


def ask(place: gate.Gate, automatic: bool = False) -> str:
    """Ask; the hash of what is shown."""
    return str(gate.request(place, automatic)["seen"]["sha256"])


def test_a_request_shows_what_came_and_waits(place: gate.Gate) -> None:
    table = gate.request(place)
    assert table == json.loads(place.approval.read_text())
    assert (table["round"], table["status"], table["history"]) == (1, "pending", [])
    assert (table["seen"]["accepted"], table["seen"]["findings"]) == (4, {"gap": {"files": 1}})
    assert gate.verdict(place) == "pending"


@pytest.mark.parametrize(("approve", "status"), [(True, "approved"), (False, "rejected")])
def test_an_answer_says_who_when_and_what_was_seen(place: gate.Gate, approve: bool, status: str) -> None:
    asked = gate.request(place)
    table = gate.answer(place, approve, ANN, asked["seen"]["sha256"], "looks\nfine")
    assert (table["status"], table["by"], table["note"]) == (status, "Ann", "looks fine")
    assert table["at"] and table["seen"] == asked["seen"]
    assert gate.verdict(place) == status
    assert [file.name for file in place.approval.parent.iterdir() if file.suffix == ".part"] == []


def test_an_answer_from_a_terminal_says_which_unix_user_gave_it(place: gate.Gate) -> None:
    table = gate.answer(place, True, gate.unix_user("root of all evil"), ask(place))
    known = table["known_by"]
    assert table["by"] == "root of all evil" and known["how"] == "unix user"
    assert known["uid"] == os.getuid() and known["user"] and known["host"]


def test_the_same_data_keep_their_answer_and_other_data_ask_again(place: gate.Gate) -> None:
    given = gate.answer(place, True, ANN, ask(place))
    assert gate.request(place) == given
    write(place, 5)
    assert gate.verdict(place) == "pending"
    again = gate.request(place)
    assert again["status"] == "pending" and "by" not in again
    assert [(entry["status"], entry["by"]) for entry in again["history"]] == [("approved", "Ann")]


@pytest.mark.parametrize("seen", ["", "0" * 12, "abc", "nonsense"])
def test_an_answer_needs_the_hash_of_what_lies_there(place: gate.Gate, seen: str) -> None:
    ask(place)
    with pytest.raises(BadInput, match=r"--seen.*gate show"):
        gate.answer(place, True, ANN, seen)
    assert gate.verdict(place) == "pending"


def test_an_answer_is_refused_when_the_data_changed_after_the_question(place: gate.Gate) -> None:
    """Even before anybody asked anew."""
    seen = ask(place)
    write(place, 5)
    with pytest.raises(BadInput, match="--seen"):
        gate.answer(place, True, ANN, seen)
    assert json.loads(place.approval.read_text())["status"] == "pending"


@pytest.mark.parametrize("second", [True, False])
def test_a_second_answer_is_refused_and_says_whose_stands(place: gate.Gate, second: bool) -> None:
    seen = ask(place)
    gate.answer(place, True, ANN, seen)
    with pytest.raises(BadInput, match=r"round 1.*approved by Ann .*--change"):
        gate.answer(place, second, BOB, seen)
    assert json.loads(place.approval.read_text())["by"] == "Ann"


def test_a_changed_mind_says_so_and_is_kept_in_the_history(place: gate.Gate) -> None:
    seen = ask(place)
    gate.answer(place, False, ANN, seen)
    table = gate.answer(place, True, BOB, seen, change=True)
    assert (table["status"], table["by"]) == ("approved", "Bob")
    assert [(entry["status"], entry["by"], entry["known_by"]) for entry in table["history"]] == [
        ("rejected", "Ann", ANN.known_by)
    ]


def test_an_automatic_answer_counts_only_while_gates_answer_themselves(place: gate.Gate) -> None:
    given = gate.settle(place, automatic=True)
    assert (given["status"], given["known_by"]) == ("approved", {"how": "automatic"})
    assert gate.settle(place, automatic=True) == given
    assert (gate.verdict(place, automatic=True), gate.verdict(place)) == ("approved", "pending")
    asked = gate.settle(place, automatic=False)
    assert (asked["status"], [entry["by"] for entry in asked["history"]]) == ("pending", [gate.AUTOMATIC])


def test_an_automatic_answer_of_before_authors_were_known_counts_no_more_either(place: gate.Gate) -> None:
    given = gate.settle(place, automatic=True)
    del given["known_by"]
    place.approval.write_text(json.dumps(given))
    assert gate.verdict(place) == "pending"


def test_a_person_is_not_overruled_by_the_automatic_gate(place: gate.Gate) -> None:
    gate.answer(place, False, ANN, ask(place))
    assert gate.settle(place, automatic=True)["by"] == "Ann"


@pytest.mark.parametrize("by", ["", " ", "NAME", "\n"])
def test_nobody_is_no_name(place: gate.Gate, by: str) -> None:
    with pytest.raises(BadInput, match="--by"):
        gate.answer(place, True, gate.unix_user(by), ask(place))


def test_no_request_no_answer(place: gate.Gate) -> None:
    with pytest.raises(BadInput, match="ingest"):
        gate.answer(place, True, ANN, "0" * 12)


def test_a_name_of_many_lines_becomes_one_line(place: gate.Gate) -> None:
    table = gate.answer(place, True, gate.unix_user("Ann\n\x1b[2Jround 1: \udcff"), ask(place))
    assert table["by"] == "Ann [2Jround 1: ?"
    assert gate.read_approval(place.approval) == table


ANSWER = {"round": 1, "status": "approved", "seen": {}, "history": [], "by": "a", "at": "b", "note": ""}
ODD_AUTHOR = json.dumps(ANSWER | {"known_by": 1})
DAMAGED = ["", "{", "[]", '{"status": "yes"}', '{"status": "approved"}', ODD_AUTHOR, "[" * 5000]


@pytest.mark.parametrize("text", [*DAMAGED, '{"round": 1, "status": "approved", "seen": {}, "history": []}'])
def test_a_damaged_answer_is_named_and_never_taken_for_a_yes(place: gate.Gate, text: str) -> None:
    place.approval.parent.mkdir(parents=True)
    place.approval.write_text(text)
    with pytest.raises(BadInput, match="round-1"):
        gate.verdict(place)


def one_answer(place: gate.Gate, number: int, seen: str, change: bool, start: Any, accepted: Any) -> None:
    start.wait()
    try:
        gate.answer(place, number % 2 == 0, gate.unix_user(f"person {number}"), seen, change=change)
        accepted.put(number)
    except BadInput as error:
        accepted.put(-1 if re.search("approved by|rejected by", str(error)) else -2)


def at_once(place: gate.Gate, people: int, change: bool) -> list[int]:
    """Answers to processes of their own at one time: the number of the person, -1 where refused."""
    fork = multiprocessing.get_context("fork")  # a fresh interpreter for each would take minutes to import
    seen, start, accepted = ask(place), fork.Barrier(people), fork.Queue()
    started = [fork.Process(target=one_answer, args=(place, n, seen, change, start, accepted)) for n in range(people)]
    for process in started:
        process.start()
    got = [accepted.get(timeout=60) for _ in started]
    for process in started:
        process.join()
    return got


def test_of_many_answers_at_once_exactly_one_wins(place: gate.Gate) -> None:
    got = at_once(place, 40, change=False)
    winner = max(got)
    assert sorted(got) == [-1] * 39 + [winner] and winner >= 0
    table = gate.read_approval(place.approval)
    assert (table["by"], table["history"]) == (f"person {winner}", [])


def test_every_accepted_change_of_many_at_once_is_in_the_history(place: gate.Gate) -> None:
    got = at_once(place, 40, change=True)
    table = gate.read_approval(place.approval)
    kept = [entry["by"] for entry in (*table["history"], table)]
    assert sorted(got) == list(range(40)) and sorted(kept) == sorted(f"person {number}" for number in got)
