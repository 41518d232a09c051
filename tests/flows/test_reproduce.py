"""A lock file that another stage is just writing is read again."""

import subprocess
import sys
import threading
import time

import pytest
from dvc.dvcfile import Lockfile
from dvc.repo import Repo
from dvc.utils.strictyaml import YAMLValidationError

from flows import reproduce


@pytest.fixture
def lockfile(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Lockfile, "_load", Lockfile._load)
    subprocess.run([sys.executable, "-m", "dvc", "init", "-q", "--no-scm"], check=True)
    with Repo() as repo:
        yield Lockfile(repo, "dvc.lock")


def test_half_a_lock_file_is_read_again_until_it_is_whole(lockfile, tmp_path):
    path = tmp_path / "dvc.lock"
    path.write_text("schema: '2.0'\nstages:\n  a:\n")
    with pytest.raises(YAMLValidationError):
        lockfile.load()
    reproduce.wait_for_whole_lockfile()

    def finish() -> None:
        time.sleep(0.3)
        path.write_text("schema: '2.0'\nstages:\n  a:\n    cmd: echo\n")

    writer = threading.Thread(target=finish)
    writer.start()
    assert lockfile.load()["stages"] == {"a": {"cmd": "echo"}}
    writer.join()


def test_a_lock_file_that_stays_damaged_is_an_error(lockfile, tmp_path, monkeypatch):
    monkeypatch.setattr(reproduce, "_PAUSE", 0.001)
    reproduce.wait_for_whole_lockfile()
    (tmp_path / "dvc.lock").write_text("schema: '2.0'\nstages:\n  a:\n")
    with pytest.raises(YAMLValidationError):
        lockfile.load()
