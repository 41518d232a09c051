"""Feet and speeds over several steps."""

import torch

from benchmarks.baselines.others.memory import FOOT_KEYS, Memory

DT = 0.02
DOWN, UP = [0.0, 0.0, 200.0], [0.0, 0.0, 0.0]


def step(memory: Memory, height: float, left: list[float], right: list[float], fresh: bool = False):
    keys = torch.zeros(1, 14, 3)
    keys[0, list(FOOT_KEYS), 2] = height
    return memory.update(keys, torch.tensor([[left, right]]), torch.tensor([fresh]))


def test_a_flight_lasts_from_the_last_contact_to_the_landing_and_keeps_its_height():
    memory = Memory(1, DT, "cpu")
    step(memory, 0.05, DOWN, DOWN, fresh=True)
    first = step(memory, 0.05, UP, DOWN)
    # the step after a contact still counts as down
    assert first.air_time[0].tolist() == [torch.tensor(DT).item()] * 2 and not first.landed.any()
    step(memory, 0.30, UP, DOWN)
    step(memory, 0.10, UP, DOWN)
    landing = step(memory, 0.06, DOWN, DOWN)
    assert landing.landed[0].tolist() == [True, False]
    assert torch.isclose(landing.air_time[0, 0], torch.tensor(3 * DT))
    assert torch.isclose(landing.height[0, 0], torch.tensor(0.30))
    again = step(memory, 0.06, DOWN, DOWN)
    assert not again.landed.any() and torch.isclose(again.height[0, 0], torch.tensor(0.06))


def test_speeds_are_differences_of_places_and_nought_in_the_first_step():
    memory = Memory(2, DT, "cpu")
    keys = torch.zeros(2, 14, 3)
    force = torch.zeros(2, 2, 3)
    memory.update(keys, force, torch.tensor([True, True]))
    keys = torch.full((2, 14, 3), 0.1)
    now = memory.update(keys, force, torch.tensor([False, True]))
    assert torch.allclose(now.key_vel_w[0], torch.tensor(5.0))
    assert now.key_vel_w[1].eq(0).all()


def test_a_new_episode_forgets_the_flight_before_it():
    memory = Memory(1, DT, "cpu")
    for _ in range(5):
        step(memory, 0.4, UP, UP)
    now = step(memory, 0.1, UP, UP, fresh=True)
    assert torch.allclose(now.air_time, torch.tensor(DT)) and torch.allclose(now.height, torch.tensor(0.1))


def test_a_world_that_blew_up_leaves_numbers():
    memory = Memory(1, DT, "cpu")
    nowhere = torch.full((1, 14, 3), float("nan"))
    memory.update(nowhere, torch.full((1, 2, 3), float("nan")), torch.tensor([False]))
    step(memory, 0.1, DOWN, DOWN, fresh=True)
    assert all(tensor.float().isfinite().all() for tensor in memory.kept().values())
