"""`bumblebee gate`: a plug-in of the library's command line, under the login of whoever types it."""

import getpass
import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bumblebee.errors import BadInput
from flows.gates import gate_answer
from flows.gates.gate_cli import app
from tasks.approvals import gate
from tests.flows.gates.test_gate_answer import waiting


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> gate.Gate:
    monkeypatch.setattr(gate_answer.servers, "running", lambda folder: None)
    return waiting(tmp_path / "lab", 3)


def typed(place: gate.Gate, *words: str) -> str:
    """Text that the command prints."""
    result = CliRunner().invoke(app, [*words, "--workspace", str(place.workspace)])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


def test_a_round_is_listed_shown_and_answered_under_the_login(
    place: gate.Gate, capsys: pytest.CaptureFixture[str]
) -> None:

    seen = gate.seen_of(place.summary)["sha256"][:12]
    listed = typed(place, "list")
    assert seen in listed and "pending" in listed and "answers in the record: 0" in listed
    assert f"--seen {seen}" in typed(place, "show", "1")
    said = typed(place, "approve", "1", "--seen", seen)
    me = getpass.getuser()
    assert f"approved by {me} (unix user {me}" in said
    table = gate.read_approval(place.approval)
    assert (table["status"], table["known_by"]["user"]) == ("approved", me)
    assert "answers in the record: 1" in typed(place, "list")


def test_a_rejection_says_why_and_nothing_is_answered_unseen(place: gate.Gate) -> None:
    seen = gate.seen_of(place.summary)["sha256"][:12]
    with pytest.raises(BadInput, match="--note: expected why"):
        typed(place, "reject", "1", "--seen", seen)
    with pytest.raises(BadInput, match="--seen"):
        typed(place, "approve", "1")
    assert gate.verdict(place) == "pending"
    typed(place, "reject", "1", "--seen", seen, "--note", "the floor was wet")
    assert json.loads(place.approval.read_text())["note"] == "the floor was wet"


def test_two_people_are_asked_for_where_the_settings_say_so(place: gate.Gate) -> None:
    (place.workspace / "params.yaml").write_text("gate: {mode: ask, people: 2}\n")
    seen = gate.seen_of(place.summary)["sha256"][:12]
    assert "1 of 2 people" in typed(place, "approve", "1", "--seen", seen)
    assert gate.verdict(place, people=2) == "pending"
    with pytest.raises(BadInput, match="a second one by"):
        typed(place, "approve", "1", "--seen", seen)


def test_the_librarys_command_line_finds_it(place: gate.Gate) -> None:
    program = Path(sys.executable).with_name("bumblebee")
    done = subprocess.run(
        [str(program), "gate", "list", "--workspace", str(place.workspace)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and "pending" in done.stdout
    done = subprocess.run([str(program), "gate", "list"], cwd="/", capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.count("\n") == 1


def test_more_is_asked_for_listed_and_shown(place: gate.Gate) -> None:
    seen = gate.seen_of(place.summary)["sha256"][:12]
    with pytest.raises(BadInput, match="--note: expected what is wanted"):
        typed(place, "more", "1", "--seen", seen)
    said = typed(place, "more", "1", "--seen", seen, "--note", "ten more walks")
    me = getpass.getuser()
    assert f"more asked for by {me} (unix user {me}" in said and "add rollouts and start again" in said
    listed = " ".join(typed(place, "list").split())
    assert "more asked for" in listed and "answers in the record: 1" in listed
    shown = typed(place, "show", "1")
    assert "ten more walks" in shown and "to go on: add rollouts" in shown and "--change" in shown
    with pytest.raises(BadInput, match="more asked for by"):
        typed(place, "approve", "1", "--seen", seen)
