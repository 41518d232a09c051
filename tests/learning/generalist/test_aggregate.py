"""Samples of DAgger: the newest ones, their past put together as the environment showed it, within bounds."""

import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.generalist.aggregate import Aggregate
from bumblebee.tracking.observing.history import History
from bumblebee.tracking.rows import Rows

WORLDS, SIZE, HISTORY, MEMORY = 3, 2, 4, 3


def filled(steps: int, capacity: int, alone: int = 1) -> tuple[Aggregate, dict[tuple[float, ...], torch.Tensor]]:
    """Random rows of three worlds with restarts, and what each sample must give, by its newest row."""
    torch.manual_seed(0)
    data = Aggregate(capacity, WORLDS, (SIZE, alone, 1), (HISTORY, MEMORY), clusters=2)
    ring, shown, age = History(WORLDS, SIZE, HISTORY), [], torch.zeros(WORLDS, dtype=torch.long)
    wanted = {}
    for step in range(steps):
        row, more = torch.randn(WORLDS, SIZE), torch.randn(WORLDS, alone)
        ring.add(row, Rows(age == 0, by_mask=True))
        shown.append(torch.cat((ring.stacked(), more), dim=-1))
        data.add(shown[-1], (row[:, :1], torch.ones(WORLDS, 1)), age, torch.tensor([0, 0, 1]))
        for world in range(WORLDS):
            past = [shown[step - back][world] for back in range(min(MEMORY, int(age[world])), -1, -1)]
            wanted[tuple(row[world].tolist())] = torch.stack(past)
        age = torch.where(torch.rand(WORLDS) < 0.15, 0, age + 1)
    return data, wanted


@pytest.mark.parametrize(("steps", "kept", "alone"), [(30, 60, 1), (30, 12, 1), (30, 12, 0), (3, 60, 0)])
def test_a_sample_has_the_past_that_its_world_saw(steps: int, kept: int, alone: int) -> None:
    """Not yet full, overwritten, and hardly begun: observations and marks are those of the steps themselves."""
    data, wanted = filled(steps, kept * WORLDS, alone)
    drawn = data.draw(400, torch.Generator().manual_seed(1))
    assert drawn.observation.shape == (400, MEMORY + 1, HISTORY * SIZE + alone) and drawn.known[:, -1].all()
    for one, marks, answer in zip(drawn.observation, drawn.known, drawn.mean, strict=True):
        newest = one[-1, (HISTORY - 1) * SIZE : HISTORY * SIZE]
        past = wanted[tuple(newest.tolist())]
        assert int(marks.sum()) == len(past) and marks[-len(past) :].all()
        assert torch.equal(one[marks], past) and answer == newest[0]


def test_the_ring_keeps_the_newest_whose_past_it_has() -> None:
    data, _ = filled(30, 12 * WORLDS)
    assert data.size == 12 * WORLDS
    held = set(data._row[..., :SIZE].flatten(0, 1)[:, 0].tolist())
    seen = data.draw(2000, torch.Generator().manual_seed(0)).observation[:, -1, (HISTORY - 1) * SIZE]
    assert set(seen.tolist()) <= held
    assert len(set(seen.tolist())) == (12 - (HISTORY + MEMORY - 1)) * WORLDS


def test_without_history_and_memory_every_sample_is_drawn() -> None:
    data = Aggregate(5, 1, (1, 0, 1))
    for value in range(8):
        answer, cluster = (torch.zeros(1, 1), torch.ones(1, 1)), torch.zeros(1, dtype=torch.long)
        data.add(torch.full((1, 1), float(value)), answer, torch.full((1,), value), cluster)
    assert data.size == 5
    drawn = data.draw(100, torch.Generator().manual_seed(0))
    assert set(drawn.observation.flatten().tolist()) == {3.0, 4.0, 5.0, 6.0, 7.0} and drawn.known.shape == (100, 1)
    assert (drawn.weight == 1).all()


def test_a_cluster_of_few_samples_counts_as_much_as_one_of_many() -> None:
    """Nine worlds of ten follow cluster 0, nobody cluster 1: the sum of weights is the same for 0 and 2, also later."""
    data, cluster = Aggregate(50, 10, (1, 0, 1), clusters=3), torch.tensor([0] * 9 + [2])
    for step in range(9):
        if step == 6:
            cluster = torch.tensor([0] * 5 + [2] * 5)
        row = cluster[:, None].float()
        data.add(row, (row, torch.ones(10, 1)), torch.full((10,), step), cluster)
        held = data._row[: min(step + 1, 5)].flatten()
        assert data.counts.tolist() == [float((held == k).sum()) for k in range(3)]
    drawn = data.draw(20_000, torch.Generator().manual_seed(0))
    sums = [float(drawn.weight[drawn.mean[:, 0] == k].sum()) for k in (0, 2)]
    assert sums == pytest.approx([10_000, 10_000], rel=0.05)


def test_a_ring_shorter_than_what_the_student_looks_back_is_refused() -> None:
    with pytest.raises(BadInput, match="capacity: expected at least 21: 7 steps of 3 worlds"):
        Aggregate(18, WORLDS, (SIZE, 1, 1), (HISTORY, MEMORY))


def test_the_memory_that_is_told_is_the_memory_that_is_taken() -> None:
    sizes = (107, 5, 23)
    data = Aggregate(4000, 10, sizes)
    taken = sum(tensor.nbytes for tensor in (data._row, data._mean, data._std, data._age, data._cluster))
    assert Aggregate.gib(4000, sizes) == pytest.approx(taken / 2**30)
