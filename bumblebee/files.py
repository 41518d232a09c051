"""Files that appear whole or not at all, and a full disk that shows as what it is."""

import io
import os
from pathlib import Path

import torch


def save_tensors(path: Path, content: object) -> None:
    """`torch.save` by way of memory: written beside `path` and renamed.

    torch's own writer turns a full disk into a RuntimeError about its container; here it is the OSError that it is.
    """
    buffer = io.BytesIO()
    torch.save(content, buffer)
    path = Path(path)
    fresh = path.with_name(f".{path.name}.part")
    try:
        fresh.write_bytes(buffer.getbuffer())
        os.replace(fresh, path)
    finally:
        fresh.unlink(missing_ok=True)
