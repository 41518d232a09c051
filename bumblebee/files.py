"""Tensors in a file that appears whole or not at all, and a full disk that shows as what it is."""

import io
from pathlib import Path

import torch

from bumblebee.io import left_overs
from bumblebee.io.whole import put


def save_tensors(path: Path, content: object) -> None:
    """`torch.save` by way of memory, whole or not at all; what a killed process left of this file is cleared.

    torch's own writer turns a full disk into a RuntimeError about its container; here it is the OSError that it is.
    """
    path, buffer = Path(path), io.BytesIO()
    torch.save(content, buffer)
    if path.parent.is_dir():
        left_overs.clear(path)
    put(path, buffer.getbuffer())
