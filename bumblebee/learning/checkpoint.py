"""Checkpoints of a training: tensors and plain values only, so that reading one never runs code.

NumPy arrays (a simulation's state) are kept as tensors with a mark beside them, and come back as they went.
"""

from pathlib import Path
from typing import Any

import numpy as np
import torch

from bumblebee.errors import BadInput
from bumblebee.files import save_tensors

_ARRAY = "numpy"


def save_checkpoint(path: Path, content: dict[str, Any]) -> None:
    """Write `content` (nested dictionaries and lists of tensors, arrays, numbers and text), whole or not at all."""
    save_tensors(path, _plain(content))


def load_checkpoint(path: Path) -> dict[str, Any]:
    """Content that `save_checkpoint` wrote, on the CPU; nothing in the file is executed.

    Raises:
        BadInput: if it is no checkpoint, or holds anything else than tensors and plain values.
    """
    try:
        content = _arrays(torch.load(path, weights_only=True, map_location="cpu"))
        if not isinstance(content, dict):
            raise ValueError(type(content).__name__)
    except OSError:
        raise
    except Exception as error:  # pickle, zip and torch raise types of their own for a file that is no checkpoint
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        remedy = "Nothing in it was executed. Remove it to train from the start."
        raise BadInput(path, "a checkpoint of tensors and plain values", reason, remedy) from None
    return content


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return {_ARRAY: torch.from_numpy(value.copy())}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_plain(part) for part in value)
    return value


def _arrays(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == {_ARRAY} and isinstance(value[_ARRAY], torch.Tensor):
            return value[_ARRAY].numpy()
        return {key: _arrays(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_arrays(part) for part in value)
    return value
