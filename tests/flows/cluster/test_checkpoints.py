"""Checkpoints on the shared remote: the last whole one comes back, under the same inputs alone; no cluster."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from dvc.repo import Repo
from dvc_objects.fs.local import LocalFileSystem

from bumblebee.learning import learner
from bumblebee.learning.generalist import distill
from flows.cluster import checkpoints
from flows.cluster.parcel import REMOTE

STAGE = {"cmd": "python own.py", "deps": ["in.txt"], "params": ["own"], "outs": ["out.txt"]}


def shelf(folder: Path) -> checkpoints.Shelf:
    return checkpoints.Shelf(LocalFileSystem(), str(folder / "shelf"))


def scratch(folder: Path, text: str = "first") -> Path:
    own = folder / "scratch" / "experts-c0"
    own.mkdir(parents=True, exist_ok=True)
    (own / "checkpoint.pt").write_text(text)
    (own / "curve.csv").write_text(f"iteration\n{text}\n")
    return folder / "scratch"


def test_the_names_are_those_that_trainings_write() -> None:
    assert set(checkpoints.WRITTEN) == {learner.CHECKPOINT, distill.CHECKPOINT}


def test_another_machine_gets_all_files_of_the_last_one(tmp_path: Path) -> None:
    own = shelf(tmp_path)
    for text in ("first", "second"):
        packed = checkpoints.pack(scratch(tmp_path, text))
        assert packed is not None
        own.put(packed)
    assert len(list((tmp_path / "shelf").iterdir())) == 1
    newest = own.newest()
    assert newest is not None
    checkpoints.unpack(newest, tmp_path / "there")
    assert (tmp_path / "there" / "experts-c0" / "checkpoint.pt").read_text() == "second"
    assert (tmp_path / "there" / "experts-c0" / "curve.csv").read_text() == "iteration\nsecond\n"
    own.clear()
    assert own.newest() is None
    own.clear()


def test_one_that_is_torn_is_passed_over_for_the_one_before(tmp_path: Path) -> None:
    own = shelf(tmp_path)
    own.put(b"whole")
    (whole,) = (tmp_path / "shelf").iterdir()
    (tmp_path / "shelf" / whole.name.replace("000000001", "000000002")).write_bytes(b"wh")
    assert own.newest() == b"whole"
    own.put(b"next")
    assert own.newest() == b"next" and len(list((tmp_path / "shelf").iterdir())) == 1


def test_a_folder_without_a_checkpoint_is_not_packed(tmp_path: Path) -> None:
    own = scratch(tmp_path)
    (own / "experts-c0" / "checkpoint.pt").unlink()
    assert checkpoints.pack(own) is None and checkpoints.pack(tmp_path / "nowhere") is None


def test_a_folder_that_changes_meanwhile_is_packed_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own, real, seen = scratch(tmp_path), checkpoints._state, []

    def changing(folder: Path) -> object:
        seen.append(folder)
        if len(seen) == 2:
            scratch(tmp_path, "grown longer")
        return real(folder)

    monkeypatch.setattr(checkpoints, "_state", changing)
    packed = checkpoints.pack(own)
    assert packed is not None and len(seen) == 4
    checkpoints.unpack(packed, tmp_path / "there")
    assert (tmp_path / "there" / "experts-c0" / "curve.csv").read_text() == "iteration\ngrown longer\n"


def until(done: Callable[[], object]) -> None:
    """Wait for the thread beside us; pytest's own limit ends what never comes."""
    while not done():
        pass


def test_while_a_stage_runs_each_new_one_is_kept_and_the_next_machine_begins_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpoints, "LOOK_EVERY", 0.01)
    own = shelf(tmp_path)
    with checkpoints.kept(own, 0.01, tmp_path / "scratch"):
        scratch(tmp_path)
        until(own.newest)
        first = own.newest()
        scratch(tmp_path, "second")
        until(lambda: own.newest() != first)
    with checkpoints.kept(own, 0.01, tmp_path / "there"):
        assert (tmp_path / "there" / "experts-c0" / "checkpoint.pt").read_text() == "second"


def test_a_store_that_fails_is_said_and_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(checkpoints, "LOOK_EVERY", 0.01)
    own = shelf(tmp_path)
    (tmp_path / "shelf").write_text("a file where the folder should be")
    with checkpoints.kept(own, 0.01, scratch(tmp_path)):
        scratch(tmp_path, "second")
        said: list[str] = []
        until(lambda: said.append(capfd.readouterr().err) or "checkpoint not kept: " in "".join(said))
        (tmp_path / "shelf").unlink()
        until(own.newest)


def test_other_inputs_or_parameters_find_no_checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = {name: repository(tmp_path / name) for name in ("one", "same", "input", "param")}
    (folders["input"] / "in.txt").write_text("other")
    (folders["param"] / "params.yaml").write_text("own: {steps: 2}\n")
    shelves = {}
    for name, folder in folders.items():
        monkeypatch.chdir(folder)
        shelves[name] = place()
    assert shelves["one"] == shelves["same"]
    assert len(set(shelves.values())) == 3
    assert shelves["one"].startswith(str(tmp_path / "remote" / checkpoints.FOLDER))


def repository(folder: Path) -> Path:
    folder.mkdir()
    subprocess.run([sys.executable, "-m", "dvc", "init", "--no-scm", "-q"], cwd=folder, check=True)
    (folder / "in.txt").write_text("in")
    (folder / "params.yaml").write_text("own: {steps: 1}\n")
    (folder / "dvc.yaml").write_text(yaml.safe_dump({"stages": {"own": STAGE}}))
    remote = f"['remote \"{REMOTE}\"']\n    url = {folder.parent / 'remote'}\n"
    (folder / ".dvc" / "config").write_text(f"[core]\n    no_scm = True\n{remote}")
    return folder


def place() -> str:
    with Repo() as repo, repo.lock:
        (stage,) = repo.stage.collect("own")
        stage.save_deps()
        return checkpoints.shelf_of(repo, stage).folder
