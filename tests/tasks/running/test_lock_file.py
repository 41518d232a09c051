"""A dvc.lock that another stage is just writing: nobody believes the half that stands there."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from dvc.dvcfile import Lockfile
from dvc.repo import Repo
from dvc.utils.strictyaml import YAMLValidationError

from bumblebee.errors import BadInput
from tasks.running import lineage, lock_file

A, B = "a" * 32, "b" * 32
WHOLE = f"""schema: '2.0'
stages:
  base:
    cmd: echo
    outs:
    - path: models/base
      md5: {A}
      size: 1
  experts:
    cmd: echo
    deps:
    - path: models/base
      md5: {A}
      size: 1
    outs:
    - path: models/experts
      md5: {B}
      size: 1
"""
BEGINNINGS = {
    "nothing": "",
    "cut off amid a word": WHOLE[: WHOLE.index("models/base") + 4],
    "YAML without the last stage": WHOLE[: WHOLE.index("  experts")],
    "a stage without its contents": WHOLE[: WHOLE.index("    cmd")],
}


@pytest.fixture
def lockfile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Lockfile]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Lockfile, "_load", Lockfile._load)
    subprocess.run([sys.executable, "-m", "dvc", "init", "-q", "--no-scm"], check=True)
    with Repo() as repo:
        yield Lockfile(repo, "dvc.lock")


def written_meanwhile(path: Path, beginning: str, read: Callable[[], object]) -> object:
    """Content that `read` finds while another writes: the beginning stands there, the rest comes 0.2 s later."""
    path.write_text(beginning)

    def finish() -> None:
        time.sleep(0.2)
        path.write_text(WHOLE)

    writer = threading.Thread(target=finish)
    writer.start()
    try:
        return read()
    finally:
        writer.join()


@pytest.mark.parametrize("beginning", BEGINNINGS.values(), ids=BEGINNINGS)
def test_lineage_waits_for_the_rest(beginning: str, tmp_path: Path) -> None:
    path = tmp_path / "dvc.lock"
    found = written_meanwhile(path, beginning, lambda: lineage.history(Path("models/experts"), path))
    assert found == [{"path": "models/base", "md5": A, "stage": "base"}]


@pytest.mark.parametrize("beginning", BEGINNINGS.values(), ids=BEGINNINGS)
def test_dvc_waits_for_the_rest(beginning: str, lockfile: Lockfile, tmp_path: Path) -> None:
    lock_file.read_whole()
    found = written_meanwhile(tmp_path / "dvc.lock", beginning, lambda: list(lockfile.load()["stages"]))
    assert found == ["base", "experts"]


def test_a_lock_file_that_stays_damaged_is_an_error(
    lockfile: Lockfile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lock_file, "PAUSE", 0.001)
    monkeypatch.setattr(lock_file, "QUIET", 0.0)
    lock_file.read_whole()
    (tmp_path / "dvc.lock").write_text(BEGINNINGS["a stage without its contents"])
    with pytest.raises(YAMLValidationError):
        lockfile.load()
    torn = "schema: '2.0'\nstages:\n  base: {"
    for text, came in (("", "0 characters without"), ("stages: {a: }", "13 characters without"), (torn, "expected")):
        (tmp_path / "dvc.lock").write_text(text)
        with pytest.raises(BadInput, match=f"its stages, came .*{came}.*Remove it"):
            lock_file.locked_stages()


def test_a_file_at_rest_is_read_at_once_and_none_has_no_stages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "dvc.lock"
    assert lock_file.locked_stages(path) == {}
    path.write_text(WHOLE)
    lock_file.settle(path)
    monkeypatch.setattr(time, "sleep", lambda seconds: pytest.fail("waited for a file at rest"))
    assert list(lock_file.locked_stages(path)) == ["base", "experts"]
