"""Gradient steps: Muon for the matrices between hidden layers, Adam for all else."""

import torch
from rsl_rl.modules import MLP

from bumblebee.learning.world_model.descent import Descent

RATE, WIDE = 0.01, 1e9


def network() -> MLP:
    torch.manual_seed(0)
    return MLP(3, 2, [8, 6, 4], "elu")


def stepped(made: MLP, steps: int) -> None:
    descent = Descent(list(made.parameters()), RATE, WIDE)
    for seed in range(steps):
        torch.manual_seed(seed)
        descent.differentiate(made(torch.rand(5, 3)).square().sum())
        descent.step()


def test_inner_matrices_go_as_torchs_muon_takes_them_at_this_rate_and_the_rest_as_adam() -> None:
    ours, theirs = network(), network()
    stepped(ours, 3)
    inner = [theirs[2].weight, theirs[4].weight]
    rest = [weight for weight in theirs.parameters() if all(weight is not other for other in inner)]
    muon = torch.optim.Muon(inner, lr=RATE, weight_decay=0.0, adjust_lr_fn="match_rms_adamw")
    adam = torch.optim.Adam(rest, lr=RATE)
    for seed in range(3):
        torch.manual_seed(seed)
        theirs.zero_grad()
        theirs(torch.rand(5, 3)).square().sum().backward()
        muon.step()
        adam.step()
    for own, other in zip(ours.parameters(), theirs.parameters(), strict=True):
        torch.testing.assert_close(own, other, rtol=1e-4, atol=1e-5)


def test_a_step_goes_as_far_as_the_rate_says_and_nowhere_at_none() -> None:
    moves = []
    for done in (0.0, 1.0):
        made = network()
        before = made[2].weight.detach().clone()
        descent = Descent(list(made.parameters()), RATE, WIDE)
        descent.decay(done)
        descent.differentiate(made(torch.ones(5, 3)).square().sum())
        descent.step()
        moves.append(made[2].weight.detach() - before)
    torch.testing.assert_close(moves[1], 0.1 * moves[0], rtol=1e-3, atol=1e-6)


def test_a_network_of_one_hidden_layer_has_no_inner_matrix_and_learns() -> None:
    torch.manual_seed(0)
    made = MLP(3, 2, [8], "elu")
    before = [weight.detach().clone() for weight in made.parameters()]
    stepped(made, 1)
    assert all(not torch.equal(old, new) for old, new in zip(before, made.parameters(), strict=True))
