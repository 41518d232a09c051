"""Values that a recording on a GPU reads: they are written into the tensors that it was recorded with."""

from dataclasses import fields
from typing import TypeVar

from torch import Tensor

from bumblebee.sim.engine import RobotState
from bumblebee.tracking.library import ReferenceFrame

Kept = TypeVar("Kept", Tensor, RobotState, ReferenceFrame)


def renewed(old: Kept, new: Kept, stays: bool) -> Kept:
    """`new`, or `old` with every tensor of `new` written into its own where it `stays`."""
    if not stays:
        return new
    if isinstance(old, Tensor):
        return old.copy_(new)
    for item in fields(new):
        if (value := getattr(new, item.name)) is not None:
            getattr(old, item.name).copy_(value)
    return old
