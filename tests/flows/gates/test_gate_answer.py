"""A gate is answered in the workspace that is named, for what was seen there; the printed command works anywhere."""

import getpass
import json
import shlex
import subprocess
from pathlib import Path

import pytest

from bumblebee import cli
from bumblebee.errors import BadInput
from flows.gates import gate_answer as gate_flow
from flows.workspace import HOME
from tasks.approvals import gate, words


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> gate.Gate:
    """A workspace with a round that waits for an answer."""
    monkeypatch.setattr(gate_flow.servers, "running", lambda folder: None)
    return waiting(tmp_path / "my lab's", 3)


def waiting(folder: Path, accepted: int) -> gate.Gate:
    made = gate.Gate(folder, 1)
    made.summary.parent.mkdir(parents=True)
    made.summary.write_text(json.dumps({"accepted": accepted, "quarantined": 1, "seconds": 4.0, "by_rule": {}}))
    for name, text in (("params.yaml", "gate: {mode: ask}\n"), ("dvc.yaml", "stages: {}\n")):
        (folder / name).write_text(text)
    return made


def answer(place: gate.Gate, *more: str) -> int:
    return cli.run(["gate", "approve", "1", "--workspace", str(place.workspace), "--by", "Ann", *more])


def test_an_answer_names_what_it_is_about_and_is_refused_for_anything_else(
    place: gate.Gate, capsys: pytest.CaptureFixture[str]
) -> None:
    seen = gate.seen_of(place.summary)["sha256"]
    for wrong in (["--seen", "f" * 12], []):
        with pytest.raises(BadInput, match=r"--seen.*gate show"):
            answer(place, *wrong)
        assert gate.verdict(place) == "pending"
    assert answer(place, "--seen", seen[:12]) == 0
    assert "(3 files accepted, 1 set aside)" in capsys.readouterr().out
    assert gate.verdict(place) == "approved"
    place.summary.write_text(place.summary.read_text().replace("3", "4"))
    with pytest.raises(BadInput, match="--seen"):
        answer(place, "--seen", seen[:12])
    assert gate.verdict(place) == "pending"


def test_the_printed_command_answers_the_right_workspace_from_any_folder(place: gate.Gate, tmp_path: Path) -> None:
    """Typed in another workspace whose own round 1 waits too, and whose packages are other ones."""
    other = waiting(tmp_path / "other", 7)
    gate.request(other)
    (other.workspace / "flows").mkdir()
    (other.workspace / "flows" / "__init__.py").write_text("raise SystemExit('foreign code ran')\n")
    line = words.how_to_answer(place.workspace, gate.request(place))
    command = next(part for part in line.split("`") if "approve" in part)
    typed = shlex.split(command)
    done = run(typed, other.workspace)
    assert done.returncode == 0, done.stderr
    assert (gate.verdict(place), gate.verdict(other)) == ("approved", "pending")
    again = run([*typed, "--by", "Bob"], other.workspace)
    assert again.returncode == 2 and again.stderr.count("\n") == 1
    assert f"approved by {getpass.getuser()}" in again.stderr and "--change" in again.stderr


def run(command: list[str], folder: Path) -> "subprocess.CompletedProcess[str]":
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(folder), "PYTHONPATH": str(HOME)}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def test_without_a_workspace_no_other_folder_is_taken_for_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The checkout has a round 1 too."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match="--workspace"):
        cli.run(["gate", "approve", "1", "--by", "Ann", "--seen", "f" * 12])


def test_a_command_with_the_name_left_blank_is_refused(place: gate.Gate) -> None:
    seen = gate.request(place)["seen"]["sha256"]
    with pytest.raises(BadInput, match="--by"):
        answer(place, "--seen", seen, "--by", "NAME")
