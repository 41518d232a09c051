"""The graph of stages: order, what is touched by a change, and gates that hold up nobody."""

import sys
from pathlib import Path

import pytest
import yaml
from dvc.repo import Repo

from bumblebee.errors import BadInput
from flows.stages import Stage, changed_stages, downstream, in_order, read_stages, to_run
from tasks.running import lock_file


def stage(name: str, *needs: str, command: str = "") -> Stage:
    return Stage(name, command, frozenset(needs), frozenset())


DIAMOND = [stage("d", "b", "c"), stage("b", "a"), stage("c", "a"), stage("a"), stage("x")]


def test_each_stage_comes_after_those_it_needs():
    order = [each.name for each in in_order(DIAMOND)]
    assert sorted(order) == ["a", "b", "c", "d", "x"]
    assert order.index("a") < order.index("b") < order.index("d") and order.index("c") < order.index("d")


def test_a_change_touches_what_follows_and_nothing_else():
    assert to_run(DIAMOND, {"b"}) == {"b", "d"}
    assert to_run(DIAMOND, set()) == set()
    assert downstream(DIAMOND, "a") == {"b", "c", "d"}


def test_titles_of_the_real_pipeline_differ():
    stages = read_stages(Path.cwd())
    assert len({each.title for each in stages}) == len(stages)


def test_a_title_names_round_and_cluster():
    refine = stage("refine@after0-c1", command="python -m tasks.refine --round 1 --cluster c1")
    assert (refine.kind, refine.title, refine.option("round")) == ("refine", "refine round 1 c1", "1")
    assert stage("seal", command="python -m tasks.seal").option("round") is None


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two stages, the second of which reads an answer that no stage makes."""
    write = f"{sys.executable} -c \"import pathlib; pathlib.Path('{{}}').write_text('1')\""
    stages = {
        "one": {"cmd": write.format("a.txt"), "params": ["one"], "outs": ["a.txt"]},
        "two": {"cmd": write.format("b.txt"), "deps": ["a.txt", "answer.json"], "outs": ["b.txt"]},
    }
    (tmp_path / "dvc.yaml").write_text(yaml.safe_dump({"stages": stages}))
    (tmp_path / "params.yaml").write_text("one: {a: 1}\n")
    Repo.init(str(tmp_path), no_scm=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_stages_are_read_with_their_needs_and_what_is_lacking(workspace: Path):
    one, two = read_stages(workspace)
    assert (one.name, one.needs, one.lacks) == ("one", frozenset(), frozenset())
    assert (two.name, two.needs, two.lacks) == ("two", frozenset({"one"}), frozenset({"answer.json"}))


def test_what_dvc_ran_is_not_changed_until_its_parameters_are(workspace: Path):
    (workspace / "answer.json").write_text("{}")
    assert changed_stages(workspace) == {"one", "two"}
    with Repo(str(workspace)) as repo:
        repo.reproduce()
    assert changed_stages(workspace) == set()
    (workspace / "params.yaml").write_text("one: {a: 2}\n")
    assert changed_stages(workspace) == {"one"}


def test_a_pipeline_that_dvc_cannot_read_is_bad_input(workspace: Path):
    (workspace / "dvc.yaml").write_text("stages: {one: {cmd: 1, typo: 2}}\n")
    with pytest.raises(BadInput, match="stages that DVC can read"):
        read_stages(workspace)


def test_a_lock_file_that_a_kill_cut_off_costs_no_finished_stage(workspace: Path, monkeypatch: pytest.MonkeyPatch):
    """The line says to remove it, and without it DVC's run cache restores what was done."""
    monkeypatch.setattr(lock_file, "LOOKS", 2)
    command = f"{sys.executable} -c \"open('runs', 'a').write('x'); open('a.txt', 'w').write('1')\""
    one = {"cmd": command, "params": ["one"], "outs": ["a.txt"]}
    (workspace / "dvc.yaml").write_text(yaml.safe_dump({"stages": {"one": one}}))
    with Repo(str(workspace)) as repo:
        repo.reproduce()
    lock = workspace / "dvc.lock"
    whole = lock.read_text()
    for cut in (0, whole.index("schema") + 3, whole.index("    cmd")):
        lock.write_text(whole[:cut])
        with pytest.raises(BadInput, match=r"dvc\.lock: expected DVC's lock file with its stages, .*Remove it"):
            read_stages(workspace)
    lock.unlink()
    with Repo(str(workspace)) as repo:
        repo.reproduce()
    assert (workspace / "runs").read_text() == "x" and lock.read_text() == whole
