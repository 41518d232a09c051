"""The model as a network: what it shares with its frozen twin."""

import torch

from bumblebee.learning.world_model.dynamics import Dynamics
from tests.learning.world_model.test_body import DT, JOINTS, bodies


def test_a_frozen_twin_predicts_what_the_model_predicts_also_later_and_its_weights_want_no_gradient():
    model, body = Dynamics(JOINTS, (8,), DT), bodies(64)
    target, context = body[:, 13 : 13 + JOINTS] + 0.1, torch.zeros(64, 0)
    twin = model.frozen()
    model.normalise(body, target, target, context, bodies(64, seed=1))
    with torch.no_grad():
        for weight in model.parameters():
            weight.add_(0.1)
    other = Dynamics(JOINTS, (8,), DT)
    for _ in range(2):
        torch.testing.assert_close(twin(body, target, target, context), model(body, target, target, context))
        model.load_state_dict(other.state_dict())
    assert not any(weight.requires_grad for weight in twin.parameters())
