"""The stages ingest and gate in a workspace of their own: files, exit codes, one line on standard error."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from bumblebee import cli
from bumblebee.errors import BadInput
from tasks import gate as gate_task
from tasks import ingest
from tasks.approvals.words import program
from tests.tasks.rounds import Setup, two_clusters

workspace = pytest.fixture(two_clusters)


def status_of(stage: Callable[[], object]) -> int:
    try:
        stage()
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


def approval() -> dict:
    return json.loads(Path("data/approvals/round-1.json").read_text())


def answer(verb: str, by: str, *more: str, seen: str = "") -> int:
    """The command, with the hash of what the request shows."""
    seen = seen or approval()["seen"]["sha256"][:12]
    return cli.run(["gate", verb, "1", "--by", by, "--seen", seen, *more])


def test_a_round_waits_for_a_person_and_goes_on_after_the_answer(
    workspace: Setup, capsys: pytest.CaptureFixture[str]
) -> None:
    workspace(bad=("c1",))
    ingest.main(1)
    made = {path.name for path in Path("data/measured/r1").iterdir()}
    assert made == {"rollouts", "model.xml", "findings.csv", "summary.json", "quarantine", "overview.html"}
    summary = json.loads(Path("data/measured/r1/summary.json").read_text())
    assert (summary["accepted"], summary["quarantined"]) == (1, 1)
    assert approval()["status"] == "pending"
    capsys.readouterr()

    assert status_of(lambda: gate_task.main(1)) == gate_task.EXIT_PENDING
    line = capsys.readouterr().err
    seen = approval()["seen"]["sha256"][:12]
    assert line.count("\n") == 1 and f"bumblebee gate approve 1 --workspace {Path.cwd()} --seen {seen}`" in line
    assert not Path("data/gates/round-1.json").exists()

    assert cli.run(["gate", "show", "1"]) == 0
    shown = capsys.readouterr().out
    assert "finite" in shown and "data/measured/r1/overview.html" in shown
    assert answer("approve", "Ann") == 0
    gate_task.main(1)
    passed = json.loads(Path("data/gates/round-1.json").read_text())
    assert (passed["status"], passed["by"], passed["seen"]["accepted"]) == ("approved", "Ann", 1)
    assert (passed["known_by"]["how"], passed["known_by"]["uid"]) == ("unix user", os.getuid())


def test_a_rejected_round_stops_and_says_who_and_why(workspace: Setup, capsys: pytest.CaptureFixture[str]) -> None:
    workspace()
    ingest.main(1)
    assert answer("approve", "Ann") == 0
    gate_task.main(1)
    assert answer("reject", "Bob", "--note", "wrong\nrobot", "--change") == 0
    capsys.readouterr()
    assert status_of(lambda: gate_task.main(1)) == gate_task.EXIT_REJECTED
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "Bob" in line and "wrong robot" in line
    assert not Path("data/gates/round-1.json").exists()


def test_a_round_of_which_more_is_wanted_waits_until_more_has_come(
    workspace: Setup, capsys: pytest.CaptureFixture[str]
) -> None:
    workspace()
    ingest.main(1)
    assert answer("more", "Ann", "--note", "the wet floor") == 0
    capsys.readouterr()
    for _ in range(2):
        assert status_of(lambda: gate_task.main(1)) == gate_task.EXIT_PENDING
        line = capsys.readouterr().err
        assert line.count("\n") == 1 and "more asked for by Ann" in line and "the wet floor" in line
        ingest.main(1)  # the same data
        capsys.readouterr()
    workspace(seed=4)
    ingest.main(1)
    assert answer("approve", "Ann") == 0
    gate_task.main(1)
    assert Path("data/gates/round-1.json").exists()


def test_other_data_need_another_answer(workspace: Setup, capsys: pytest.CaptureFixture[str]) -> None:
    workspace()
    ingest.main(1)
    assert answer("approve", "Ann") == 0
    workspace(seed=4)
    ingest.main(1)
    assert status_of(lambda: gate_task.main(1)) == gate_task.EXIT_PENDING
    assert [entry["by"] for entry in approval()["history"]] == ["Ann"]


def test_the_same_data_give_the_same_bytes_and_keep_the_answer(workspace: Setup) -> None:
    workspace()
    ingest.main(1)
    first = {path: path.read_bytes() for path in Path("data/measured").rglob("*") if path.is_file()}
    assert answer("approve", "Ann") == 0
    ingest.main(1)
    assert {path: path.read_bytes() for path in Path("data/measured").rglob("*") if path.is_file()} == first
    assert approval()["status"] == "approved"


def test_the_automatic_gate_answers_itself_and_says_so(workspace: Setup, capsys: pytest.CaptureFixture[str]) -> None:
    workspace("auto")
    ingest.main(1)
    assert approval()["by"] == "automatic (gate.mode: auto)"
    assert "automatic" in capsys.readouterr().out
    gate_task.main(1)
    assert Path("data/gates/round-1.json").exists()


def test_the_automatic_gate_does_not_overrule_a_person(workspace: Setup) -> None:
    workspace("auto")
    ingest.main(1)
    assert answer("reject", "Bob", "--change", "--note", "late") == 0
    ingest.main(1)
    assert status_of(lambda: gate_task.main(1)) == gate_task.EXIT_REJECTED


def test_an_answer_with_the_hash_of_other_data_is_refused(workspace: Setup, capsys: pytest.CaptureFixture[str]) -> None:
    workspace(bad=("c1",))
    ingest.main(1)
    seen = approval()["seen"]["sha256"]
    capsys.readouterr()
    cli.run(["gate", "show", "1"])
    assert seen[:12] in capsys.readouterr().out
    for wrong in ("0" * 12, seen[:3], "nonsense"):
        with pytest.raises(BadInput, match=seen[:12]):
            answer("approve", "Ann", seen=wrong)
        assert approval()["status"] == "pending"
    with pytest.raises(BadInput, match="gate show"):
        cli.run(["gate", "approve", "1", "--by", "Ann"])
    assert answer("approve", "Ann", seen=seen[:12]) == 0
    said = capsys.readouterr().out
    assert f"{seen[:12]} (1 files accepted, 1 set aside)" in said
    assert approval()["status"] == "approved"


def test_another_model_needs_another_answer(workspace: Setup) -> None:
    """Rollouts beside another declared model that passes them too are not what was approved."""
    workspace()
    ingest.main(1)
    assert answer("approve", "Ann") == 0
    text = Path("data/measured/r1/model.xml").read_text()
    Path("data/rollouts/r1/c0/model.xml").write_text(text + "<!-- another -->\n")
    ingest.main(1)
    assert approval()["status"] == "pending"


def test_as_a_process_the_gate_ends_with_its_status_and_one_line(workspace: Setup) -> None:
    folder = workspace()
    root = str(Path(gate_task.__file__).parents[1])
    run = subprocess.run(
        [sys.executable, "-m", "tasks.gate", "--round", "1"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": root},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 2 and run.stderr.count("\n") == 1 and "summary.json" in run.stderr


def test_the_automatic_answer_does_not_count_once_a_person_is_asked(workspace: Setup) -> None:
    folder = workspace("auto")
    ingest.main(1)
    gate_task.main(1)
    (folder / "params.yaml").write_text("ingest: {}\ngate: {mode: ask}\n")
    assert status_of(lambda: gate_task.main(1)) == gate_task.EXIT_PENDING
    assert not Path("data/gates/round-1.json").exists()
    assert [entry["known_by"] for entry in approval()["history"]] == [{"how": "automatic"}]
    assert answer("approve", "Ann") == 0
    assert status_of(lambda: gate_task.main(1)) == 0


def test_the_automatic_answer_stands_when_the_same_files_come_in_again(workspace: Setup) -> None:
    """Another time of day in the answer would make everything behind the gate stale."""
    workspace("auto")
    ingest.main(1)
    first = Path("data/approvals/round-1.json").read_bytes()
    ingest.main(1)
    gate_task.main(1)
    assert Path("data/approvals/round-1.json").read_bytes() == first


def test_the_gate_does_not_pass_data_that_changed_after_the_answer(workspace: Setup) -> None:
    workspace()
    ingest.main(1)
    assert answer("approve", "Ann") == 0
    summary = Path("data/measured/r1/summary.json")
    summary.write_text(summary.read_text().replace('"round": 1', '"round":  1'))
    assert status_of(lambda: gate_task.main(1)) == gate_task.EXIT_PENDING
    assert not Path("data/gates/round-1.json").exists()


def test_a_look_from_another_folder_prints_commands_for_this_workspace(
    workspace: Setup, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    folder = workspace()
    ingest.main(1)
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    capsys.readouterr()
    assert cli.run(["gate", "show", "1", "--workspace", str(folder)]) == 0
    shown = capsys.readouterr().out
    for verb in ("approve", "reject"):
        assert f"{program()} gate {verb} 1 --workspace {folder} --seen " in shown
    assert not list(Path.cwd().iterdir())
