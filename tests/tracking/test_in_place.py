"""Tensors that a recording reads stay where they are; elsewhere new values replace old ones."""

from dataclasses import dataclass

import torch
from torch import Tensor

from bumblebee.tracking.in_place import renewed


@dataclass(frozen=True)
class Seen:
    place: Tensor
    force: Tensor | None = None


def test_values_that_stay_keep_their_tensors_and_take_the_new_numbers() -> None:
    old, new = torch.zeros(2), torch.ones(2)
    assert renewed(old, new, False) is new and bool((old == 0).all())
    assert renewed(old, new, True) is old and bool((old == 1).all())
    was = Seen(torch.zeros(2))
    now = renewed(was, Seen(torch.ones(2)), True)
    assert now is was and now.force is None and bool((was.place == 1).all())
