"""Tensors are written whole or not at all, and a full disk is an OSError that names the file."""

import errno
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
