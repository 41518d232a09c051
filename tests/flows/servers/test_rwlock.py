"""DVC's record of who reads and writes: half a file of a killed process stops nobody, and one that is in use stays."""

from pathlib import Path

import pytest
import yaml
from dvc.lock import make_lock
from dvc.repo import Repo
from dvc.rwlock import RWLockFileCorruptedError

from flows import reproduce
from flows.servers.rwlock import clear_cut_off
from flows.stages import changed_stages

HALVES = ["", '{"write": {"a.txt": {"pid": 41', '{"read": {}, "write": {}']


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One stage that writes a file."""
    stages = {"one": {"cmd": "echo 1 > a.txt", "outs": ["a.txt"]}}
    (tmp_path / "dvc.yaml").write_text(yaml.safe_dump({"stages": stages}))
    Repo.init(str(tmp_path), no_scm=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def record(workspace: Path) -> Path:
    return workspace / ".dvc" / "tmp" / "rwlock"


@pytest.mark.parametrize("half", HALVES)
def test_half_a_record_of_a_killed_process_stops_no_start(workspace: Path, half: str) -> None:
    record(workspace).write_text(half)
    with pytest.raises(RWLockFileCorruptedError), Repo(str(workspace)) as repo:
        repo.status()
    assert changed_stages(workspace) == {"one"}
    record(workspace).write_text(half)
    assert reproduce.main(["one"]) == 0
    assert (workspace / "a.txt").read_text() == "1\n"


def test_a_whole_record_and_one_that_is_being_written_stay(workspace: Path) -> None:
    clear_cut_off(workspace)
    assert not record(workspace).exists()
    record(workspace).write_text('{"read": {}, "write": {}}')
    clear_cut_off(workspace)
    assert record(workspace).exists()
    record(workspace).write_text('{"read"')
    with make_lock(str(record(workspace)) + ".lock", tmp_dir=str(record(workspace).parent)):
        clear_cut_off(workspace)
    assert record(workspace).read_text() == '{"read"'
