"""The gate: an answer binds to what was seen, is kept with its history, and falls back when other data come."""

import json
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.measured import gate


@pytest.fixture
def summary(tmp_path: Path) -> Path:
    return write(tmp_path / "summary.json", 4)


def write(path: Path, accepted: int) -> Path:
    path.write_text(
        json.dumps({"accepted": accepted, "quarantined": 1, "seconds": 8.0, "by_rule": {"gap": {"files": 1}}})
    )
    return path


def test_a_request_shows_what_came_and_waits(tmp_path: Path, summary: Path) -> None:
    path = tmp_path / "approvals" / "round-1.json"
    table = gate.request(path, 1, summary)
    assert table == json.loads(path.read_text())
    assert (table["round"], table["status"], table["history"]) == (1, "pending", [])
    assert (table["seen"]["accepted"], table["seen"]["findings"]) == (4, {"gap": {"files": 1}})
    assert gate.verdict(path, summary) == "pending"


@pytest.mark.parametrize(("approve", "status"), [(True, "approved"), (False, "rejected")])
def test_an_answer_says_who_when_and_what_was_seen(tmp_path: Path, summary: Path, approve: bool, status: str) -> None:
    path = tmp_path / "round-1.json"
    asked = gate.request(path, 1, summary)
    table = gate.answer(path, approve, "Ann", "looks fine")
    assert (table["status"], table["by"], table["note"]) == (status, "Ann", "looks fine")
    assert table["at"] and table["seen"] == asked["seen"]
    assert gate.verdict(path, summary) == status
    assert [file.name for file in tmp_path.iterdir() if file.suffix == ".part"] == []


def test_the_same_data_keep_their_answer_and_other_data_ask_again(tmp_path: Path, summary: Path) -> None:
    path = tmp_path / "round-1.json"
    gate.request(path, 1, summary)
    given = gate.answer(path, True, "Ann")
    assert gate.request(path, 1, summary) == given
    write(summary, 5)
    assert gate.verdict(path, summary) == "pending"
    again = gate.request(path, 1, summary)
    assert again["status"] == "pending" and "by" not in again
    assert [(entry["status"], entry["by"]) for entry in again["history"]] == [("approved", "Ann")]


def test_a_changed_mind_is_kept_in_the_history(tmp_path: Path, summary: Path) -> None:
    path = tmp_path / "round-1.json"
    gate.request(path, 1, summary)
    gate.answer(path, False, "Ann")
    table = gate.answer(path, True, "Bob")
    assert (table["status"], table["by"]) == ("approved", "Bob")
    assert [(entry["status"], entry["by"]) for entry in table["history"]] == [("rejected", "Ann")]


def test_no_request_no_answer_and_nobody_is_no_name(tmp_path: Path, summary: Path) -> None:
    with pytest.raises(BadInput, match="ingest"):
        gate.answer(tmp_path / "round-1.json", True, "Ann")
    gate.request(tmp_path / "round-1.json", 1, summary)
    with pytest.raises(BadInput, match="--by"):
        gate.answer(tmp_path / "round-1.json", True, " ")


@pytest.mark.parametrize("text", ["", "{", "[]", '{"status": "yes"}', '{"status": "approved"}'])
def test_a_damaged_answer_is_named_and_never_taken_for_a_yes(tmp_path: Path, summary: Path, text: str) -> None:
    path = tmp_path / "round-1.json"
    path.write_text(text)
    with pytest.raises(BadInput, match="round-1"):
        gate.verdict(path, summary)
