"""Values that a recording on a GPU reads: they are written into the tensors that it was recorded with."""

from dataclasses import fields
from typing import Any, TypeVar

from torch import Tensor

Kept = TypeVar("Kept")


def renewed(old: Kept, new: Kept, stays: bool) -> Kept:
    """`new`, a tensor or a dataclass of tensors; where it `stays`, `old` with the numbers of `new` in its tensors."""
    if not stays:
        return new
    into: Any = old
    given: Any = new
    if isinstance(given, Tensor):
        into.copy_(given)
        return old
    for item in fields(given):
        if (value := getattr(given, item.name)) is not None:
            getattr(into, item.name).copy_(value)
    return old
