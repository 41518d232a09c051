"""Errors of the model by horizon: of worlds that it never learned from, each in its unit."""

import math

import pytest
import torch

from bumblebee.learning.world_model.accuracy import accuracy
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.memory import Memory

DT, JOINTS, WORLDS, STEPS = 0.02, 2, 64, 40


def gliding(turn: float = 0.0, joint: float = 0.0) -> Memory:
    """Worlds at uniform motion: about the vertical [rad/s] and of the joints [rad/s]."""
    memory, still = Memory(STEPS, torch.zeros(WORLDS, 0), JOINTS), torch.zeros(WORLDS, JOINTS)
    for step in range(STEPS):
        body, angle = torch.zeros(WORLDS, 13 + 2 * JOINTS), turn * step * DT / 2
        body[:, 3], body[:, 6] = math.cos(angle), math.sin(angle)
        body[:, 12] = turn
        body[:, 13 : 13 + JOINTS], body[:, 13 + JOINTS :] = joint * step * DT, joint
        columns = dict.fromkeys(("target", "before", "action", "earlier"), still)
        memory.begin(torch.zeros(WORLDS).long(), torch.zeros(WORLDS).long(), body=body, **columns)
        memory.end(torch.zeros(WORLDS, dtype=torch.bool))
    return memory


def wrong(**columns: float) -> Dynamics:
    """Predicts uniform motion and a constant change of some columns a step."""
    model = Dynamics(JOINTS, (4,), DT)
    with torch.no_grad():
        model.layers[-1].weight.zero_()
        for column, value in columns.items():
            model.layers[-1].bias[int(column[1:])] = value
    return model


def test_errors_are_told_by_horizon_each_in_its_unit() -> None:
    found = accuracy(wrong(c0=0.001, c5=0.002, c12=0.003, c13=0.003), gliding()).by_horizon
    for name, steps in (("0.02s", 1), ("0.2s", 10), ("0.6s", 30)):
        assert found[f"turn_mrad_{name}"] == pytest.approx(2 * steps, rel=1e-3)
        assert found[f"joints_mrad_{name}"] == pytest.approx(3 * steps, rel=1e-3)
    assert found["place_mm_0.02s"] == pytest.approx(1, rel=1e-3) and found["place_mm_0.2s"] == pytest.approx(10, 0.01)


def test_uniform_motion_is_predicted_without_a_network_and_a_model_is_compared_with_it() -> None:
    memory = gliding(turn=1.0, joint=2.0)
    found = accuracy(wrong(), memory)
    assert max(found.by_horizon.values()) < 0.1 and found.loss == pytest.approx(found.still, abs=1e-8)
    worse = accuracy(wrong(c0=0.5), memory)
    assert worse.loss > worse.still


def test_errors_are_of_worlds_that_no_window_to_learn_from_is_of_nor_of_steps_over_a_reset() -> None:
    torch.manual_seed(0)
    memory = gliding()
    memory.context = torch.arange(WORLDS)[:, None].float()
    learned = {int(world) for world in memory.windows(4, 4000).context[:, 0]}
    held_out = {int(world) for world in memory.held_out_windows(4).context[:, 0]}
    assert held_out == {16, 48} and learned == set(range(WORLDS)) - held_out
    memory.context = torch.zeros(WORLDS, 0)
    memory.columns["body"][20:, :, 0] += 5.0
    memory.broken[19] = True
    found = accuracy(wrong(), memory).by_horizon
    assert found["place_mm_0.2s"] == 0 and math.isnan(found["place_mm_0.6s"])
