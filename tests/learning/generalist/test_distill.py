"""Distillation: the KL against torch's, and a student that comes to agree with its experts."""

import torch
from torch.distributions import Independent, Normal, kl_divergence

from bumblebee.learning.gaussian import gaussian, gaussian_kl
from bumblebee.learning.policy import Shape, new_actor


def test_kl_is_torchs() -> None:
    torch.manual_seed(0)
    mean, other = torch.randn(5, 3), torch.randn(5, 3)
    std, other_std = torch.rand(5, 3) + 0.1, torch.rand(5, 3) + 0.1
    expected = kl_divergence(Independent(Normal(mean, std), 1), Independent(Normal(other, other_std), 1))
    torch.testing.assert_close(gaussian_kl(mean, std, other, other_std), expected)


def test_kl_is_zero_only_between_equals() -> None:
    mean, std = torch.randn(4, 3), torch.full((3,), 0.3)
    assert gaussian_kl(mean, std, mean, std).abs().max() < 1e-6
    assert (gaussian_kl(mean, std, mean + 0.1, std) > 0.1).all()
    assert (gaussian_kl(mean, std, mean, 2 * std) > 0.1).all()


def test_learning_by_kl_recovers_the_experts_mean_and_spread() -> None:
    torch.manual_seed(0)
    shape = Shape(observation=6, critic_observation=6, actions=2, hidden=(32,), ahead=())
    expert, student = new_actor(shape, initial_std=0.2), new_actor(shape, initial_std=1.0)
    torch.nn.init.normal_(expert.mlp[-1].weight, std=0.3)
    optimiser = torch.optim.Adam(student.parameters(), lr=3e-3)
    losses = []
    for _ in range(400):
        seen = torch.randn(256, 6)
        with torch.no_grad():
            wanted = gaussian(expert, seen)
        loss = gaussian_kl(*gaussian(student, seen), *wanted).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert losses[-1] < 0.1 * losses[0]
    _, spread = gaussian(student, torch.randn(1, 6))
    torch.testing.assert_close(spread, torch.full((1, 2), 0.2), atol=0.06, rtol=0)
