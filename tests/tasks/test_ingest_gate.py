"""The stages ingest and gate in a workspace of their own: files, exit codes, one line on standard error."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee import cli
from bumblebee.errors import BadInput
from bumblebee.measured.gate_words import program
from bumblebee.measured.rollout import read_rollout, write_rollout
from bumblebee.robot.facts import joints
from bumblebee.robot.model import gains
from tasks import gate as gate_task
from tasks import ingest
from tests.measured.simulated import g1_rollout

Setup = Callable[..., Path]


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Setup:
    """A workspace with two clusters of one rollout each, of which the second may be bad."""
    monkeypatch.chdir(tmp_path)
    for module in (ingest, gate_task):
        monkeypatch.setattr(module, "log_run", lambda *_, **__: None)

    def make(mode: str = "ask", bad: tuple[str, ...] = (), seed: int = 0) -> Path:
        (tmp_path / "params.yaml").write_text(f"ingest: {{}}\ngate: {{mode: {mode}}}\n")
        for number, cluster in enumerate(("c0", "c1")):
            rollout = g1_rollout(seed + number, 0.1, seconds=2.0)
            rollout = replace(rollout, meta=rollout.meta | {"cluster": cluster})
            if cluster in bad:
                rollout = replace(rollout, joint_pos=np.full_like(rollout.joint_pos, np.nan))
            write_rollout(Path(f"data/rollouts/r1/{cluster}/rollouts/{rollout.rollout_id}.parquet"), rollout)
        return tmp_path

    return make


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


def test_a_round_without_one_good_file_fails_and_keeps_what_was_found(workspace: Setup) -> None:
    workspace(bad=("c0", "c1"))
    with pytest.raises(BadInput, match=r"2 files that all fail.*data/rejected/r1") as failed:
        ingest.main(1)
    assert "\n" not in str(failed.value)
    assert not Path("data/approvals").exists()
    assert not any(path.is_file() for path in Path("data/measured").rglob("*"))
    kept = Path("data/rejected/r1")
    assert {path.name for path in kept.iterdir()} == {"findings.csv", "overview.html", "quarantine"}
    assert len(list((kept / "quarantine").glob("*.parquet"))) == 2
    assert "finite" in (kept / "findings.csv").read_text()


def test_an_accepted_round_takes_away_what_an_earlier_try_left(workspace: Setup) -> None:
    workspace(bad=("c0", "c1"))
    with pytest.raises(BadInput):
        ingest.main(1)
    shutil.rmtree("data/rollouts")
    workspace()
    ingest.main(1)
    assert not Path("data/rejected/r1").exists()


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


@pytest.mark.parametrize(("factor", "fatal"), [(1.1, False), (1000.0, True)])
def test_gains_other_than_declared_are_a_condition_and_absurd_ones_are_set_aside(
    workspace: Setup, factor: float, fatal: bool
) -> None:
    folder = workspace()
    (folder / "params.yaml").write_text("ingest: {}\ngate: {mode: ask}\n")
    kd = [factor * gains(joint)[1] for joint in joints()]
    rollout = g1_rollout(3, 0.1, seconds=2.0)
    rollout = replace(rollout, rollout_id="kd", meta=rollout.meta | {"kd": kd})
    write_rollout(Path("data/rollouts/r1/c0/rollouts/kd.parquet"), rollout)
    ingest.main(1)
    assert Path("data/measured/r1/quarantine/kd.parquet").exists() == fatal
    rules = json.loads(Path("data/measured/r1/summary.json").read_text())["by_rule"]
    assert set(rules) == {"gains"}  # said in both cases


def test_models_that_differ_between_clusters_are_named(workspace: Setup) -> None:
    workspace()
    for cluster in ("c0", "c1"):
        Path(f"data/rollouts/r1/{cluster}/model.xml").write_text(f"<mujoco model='{cluster}'/>")
    with pytest.raises(BadInput, match="same model"):
        ingest.main(1)


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


def test_files_that_name_no_cluster_get_their_folders_in_our_copies_alone(workspace: Setup) -> None:
    """All clusters' rollouts lie together after it; what a person made lies where it was, to the byte."""
    workspace()
    for cluster in ("c0", "c1"):
        nameless(Path(f"data/rollouts/r1/{cluster}/rollouts"))
    before = {path: path.read_bytes() for path in Path("data/rollouts").rglob("*.parquet")}
    ingest.main(1)
    copies = [read_rollout(path) for path in sorted(Path("data/measured/r1/rollouts").iterdir())]
    assert [copy.meta["cluster"] for copy in copies] == ["c0", "c1"]
    assert {path: path.read_bytes() for path in before} == before
    originals = {read_rollout(path).rollout_id: read_rollout(path) for path in before}
    for copy in copies:
        original = originals[copy.rollout_id]
        assert copy.columns == original.columns and copy.meta == original.meta | {"cluster": copy.meta["cluster"]}
        assert all(np.array_equal(getattr(copy, c), getattr(original, c)) for c in ("time", *copy.columns))
    summary = json.loads(Path("data/measured/r1/summary.json").read_text())
    assert set(summary["by_cluster"]) == {"c0", "c1"} and {file["cluster"] for file in summary["files"]} == {"c0", "c1"}
    assert not list(Path("data/measured/r1").glob("*.parquet"))


def test_one_folder_of_everything_says_no_cluster(workspace: Setup) -> None:
    """The folder of a round is nobody's: its files are taken as they are."""
    workspace()
    shutil.move("data/rollouts/r1/c0/rollouts", "data/rollouts/r1/rollouts")
    shutil.rmtree("data/rollouts/r1/c0")
    shutil.rmtree("data/rollouts/r1/c1")
    nameless(Path("data/rollouts/r1/rollouts"))
    ingest.main(1)
    [copy] = Path("data/measured/r1/rollouts").iterdir()
    assert copy.read_bytes() == Path("data/rollouts/r1/rollouts", copy.name).read_bytes()


def nameless(folder: Path) -> None:
    """Take the cluster out of the metadata of the rollouts in a folder."""
    for path in folder.iterdir():
        rollout = read_rollout(path)
        path.unlink()
        write_rollout(path, replace(rollout, meta={k: v for k, v in rollout.meta.items() if k != "cluster"}))


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


@pytest.mark.parametrize(
    ("text", "named"),
    [("[1]", "JSON object"), ('{"joints": 5}', "joints"), ('{"joints": ["a"], "kp": ["b"]}', "kp"), ("{", "JSON")],
)
def test_a_broken_policy_contract_beside_the_rollouts_is_one_line(workspace: Setup, text: str, named: str) -> None:
    workspace()
    Path("data/rollouts/r1/c0/contract.json").write_text(text)
    with pytest.raises(BadInput, match=rf"contract\.json.*{named}"):
        ingest.main(1)


@pytest.mark.parametrize("pattern", ["data/{", "{0}", "{cluster}", "{round.x}"])
def test_a_pattern_with_other_fields_is_one_line(pattern: str) -> None:
    with pytest.raises(BadInput, match=r"ingest\.incoming"):
        ingest.incoming_of(pattern, 1)
