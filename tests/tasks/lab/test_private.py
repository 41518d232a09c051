"""Nobody but the owner gets at DVC's databases, which the owner's next run opens."""

import os
import shlex
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from flows import workspace as workspaces
from tasks.lab.private import INDEX, private, private_index
from tasks.running.stage import run_stage


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.fixture
def open_umask() -> Iterator[None]:
    old = os.umask(0)
    yield
    os.umask(old)


@pytest.fixture
def left_by_dvc(tmp_path: Path) -> Path:
    """A workspace as DVC leaves it: its databases where everybody may write."""
    index = tmp_path / INDEX / "repo"
    index.mkdir(parents=True)
    (index / "db").write_text("of whom?")
    for folder in (index.parent, index):
        folder.chmod(0o777)
    return tmp_path


def test_what_others_could_write_to_is_made_again_at_a_start(left_by_dvc: Path):
    private_index(left_by_dvc)
    index = left_by_dvc / INDEX
    assert [mode(index), mode(index / "repo")] == [0o700, 0o700] and list((index / "repo").iterdir()) == []
    (index / "repo" / "db").touch()
    private_index(left_by_dvc)
    assert (index / "repo" / "db").exists()


def test_a_stage_closes_it_and_leaves_what_dvc_has_open(left_by_dvc: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("DVC_STAGE", "seal")
    monkeypatch.setenv("DVC_ROOT", str(left_by_dvc))
    monkeypatch.setattr("tasks.running.stage.check_once", lambda: None)
    run_stage(lambda: None, [], logs=False)
    index = left_by_dvc / INDEX
    assert [mode(index), mode(index / "repo")] == [0o700, 0o700] and (index / "repo" / "db").exists()


def test_plain_dvc_keeps_its_databases_in_a_private_folder_of_the_workspace(tmp_path: Path, open_umask: None):
    folder = workspaces.create(tmp_path / "lab")
    (folder / ".dvc" / "config.local").read_text()
    bare = {name: value for name, value in os.environ.items() if not name.startswith("DVC_")}
    code = "from dvc.repo import Repo; repo = Repo(); print(repo.site_cache_dir); repo.close()"
    used = Path(subprocess.check_output([sys.executable, "-c", code], cwd=folder, env=bare, text=True).strip())
    assert used.is_relative_to(folder / INDEX) and any(used.iterdir())
    assert [mode(folder / INDEX), mode(folder / INDEX / "repo")] == [0o700, 0o700]


def test_settings_of_this_copy_are_kept_and_follow_a_workspace_that_was_moved(tmp_path: Path):
    (tmp_path / "one" / ".dvc").mkdir(parents=True)
    local = tmp_path / "one" / ".dvc" / "config.local"
    local.write_text("[core]\n    remote = lab\n['remote \"lab\"']\n    url = /lab\n")
    private_index(tmp_path / "one")
    (tmp_path / "one").rename(tmp_path / "two")
    private_index(tmp_path / "two")
    text = (tmp_path / "two" / ".dvc" / "config.local").read_text()
    assert str(tmp_path / "two" / INDEX) in text and "/one/" not in text
    assert "remote = lab" in text and "url = /lab" in text


def test_a_folder_that_is_not_ones_own_is_refused_with_a_remedy_that_works(tmp_path: Path):
    place = tmp_path / "my index"
    place.symlink_to(tmp_path)
    with pytest.raises(BadInput, match="a folder of your own, came a link") as caught:
        private(place)
    subprocess.run(shlex.split(caught.value.do.partition(",")[0]), check=True)
    assert mode(private(place)) == 0o700
