"""Tensors are written whole or not at all, and a full disk is an OSError that names the file."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from bumblebee.files import save_tensors


def test_round_trip(tmp_path: Path) -> None:
    save_tensors(tmp_path / "a.pt", {"x": torch.arange(3)})
    assert torch.equal(torch.load(tmp_path / "a.pt", weights_only=True)["x"], torch.arange(3))
    assert [file.name for file in tmp_path.iterdir()] == ["a.pt"]


def test_a_full_disk_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_tensors(tmp_path / "a.pt", torch.zeros(2))

    def full(path: Path, content: bytes) -> int:
        with path.open("wb") as file:
            file.write(content[:10])
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        save_tensors(tmp_path / "a.pt", torch.ones(2))
    assert torch.equal(torch.load(tmp_path / "a.pt", weights_only=True), torch.zeros(2))
    assert [file.name for file in tmp_path.iterdir()] == ["a.pt"]


def test_what_a_killed_process_left_of_a_file_goes_with_the_next_save_and_a_living_ones_stays(tmp_path: Path):
    with subprocess.Popen([sys.executable, "-c", ""]) as gone:
        pass
    dead, alive, other = (
        tmp_path / f".{name}.part" for name in (f"a.pt.{gone.pid}.7", f"a.pt.{os.getpid()}.7", "b.pt.1")
    )
    for left in (dead, alive, other):
        left.write_bytes(b"half")
    save_tensors(tmp_path / "a.pt", torch.arange(3))
    assert sorted(tmp_path.iterdir()) == sorted([alive, other, tmp_path / "a.pt"])
