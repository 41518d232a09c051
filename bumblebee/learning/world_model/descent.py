"""Gradient steps on some weights, in tensors that stay where they are, so that a step can be recorded."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor, nn

from bumblebee.learning.ppo.update_graph import Recorded
from bumblebee.learning.ranks import Ranks

_LOWEST = 0.1  # of the learning rate, at the end of its cosine


class Descent:
    """Muon and Adam at a rate that falls along a cosine, with bounded gradients.

    Muon takes the matrices between hidden layers, Adam all else. A recorded step must not ask the rate's tensor for its
    number, as torch's Muon does: it takes a step of rate 1, of which the rate's share is kept.

    Args:
        weights: what learns, all on one device.
        rate: learning rate at first.
        grad_norm: gradients are scaled down to this norm.
    """

    def __init__(self, weights: Sequence[nn.Parameter], rate: float, grad_norm: float) -> None:
        self.weights, self._first, self._norm = list(weights), rate, grad_norm
        device = self.weights[0].device
        self.rate, self.steepness = torch.tensor(rate, device=device), torch.zeros((), device=device)
        matrices = [weight for weight in self.weights if weight.ndim == 2]
        self._inner = matrices[1:-1]
        rest = [weight for weight in self.weights if weight.ndim != 2] + matrices[:1] + matrices[1:][-1:]
        self._adam = torch.optim.Adam(rest, lr=self.rate, fused=True, capturable=device.type == "cuda")
        self._muon = _muon(self._inner) if self._inner else None
        self._gradients = [torch.zeros_like(weight) for weight in self.weights]
        for weight, gradient in zip(self.weights, self._gradients, strict=True):
            weight.grad = gradient

    def decay(self, done: float) -> None:
        """Set the rate for a training of which the share `done` lies behind."""
        self.rate.fill_(self._first * (_LOWEST + (1 - _LOWEST) * 0.5 * (1 + math.cos(math.pi * done))))

    def differentiate(self, loss: Tensor) -> None:
        """Take the gradient of `loss` ()."""
        torch._foreach_copy_(self._gradients, torch.autograd.grad(loss, self.weights))

    def exchange(self, ranks: Ranks) -> None:
        """Replace the gradient by its mean over all ranks, equal to the bit on all."""
        flat = torch.cat([gradient.flatten() for gradient in self._gradients])
        ranks.add(flat)
        parts = (flat / ranks.count).split([gradient.numel() for gradient in self._gradients])
        torch._foreach_copy_(self._gradients, [p.view_as(g) for p, g in zip(parts, self._gradients, strict=True)])

    def step(self) -> None:
        """Go one step down the gradient; `steepness` () is its norm before it is bounded."""
        self.steepness.copy_(torch.nn.utils.clip_grad_norm_(self.weights, self._norm))
        self._adam.step()
        if self._muon is not None:
            inner = [weight.detach() for weight in self._inner]
            before = [weight.clone() for weight in inner]
            self._muon.step()
            torch._foreach_copy_(inner, [old.lerp(new, self.rate) for old, new in zip(before, inner, strict=True)])

    def state_dict(self) -> dict[str, Any]:
        """State of the optimisers, beside weights and rate."""
        return {"adam": self._adam.state_dict()} | ({"muon": self._muon.state_dict()} if self._muon else {})

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self._adam.load_state_dict(saved["adam"])
        if self._muon is not None:
            self._muon.load_state_dict(saved["muon"])
        for group in self._adam.param_groups:
            group["lr"] = self.rate


def _muon(matrices: list[nn.Parameter]) -> torch.optim.Muon:
    """Muon at a rate of 1, with steps as large as Adam's and no decay."""
    return torch.optim.Muon(matrices, lr=1.0, weight_decay=0.0, adjust_lr_fn="match_rms_adamw")


class Learning:
    """A gradient step of several networks, which ranks take together; recorded on a GPU.

    Several ranks exchange their gradients inside the recording, as NCCL allows once a few steps were taken.

    Args:
        differentiate: takes the gradients of all `descents`.
        apply: steps down them.
        descents: of the networks.
        ranks: the processes that learn together.
    """

    def __init__(
        self,
        differentiate: Callable[[], None],
        apply: Callable[[], None],
        descents: Sequence[Descent],
        ranks: Ranks,
    ) -> None:
        self._differentiate, self._apply, self._descents, self._ranks = differentiate, apply, descents, ranks
        self._recorded = Recorded(self._step, descents[0].rate.device, lambda: [])

    def __call__(self) -> None:
        """Learn once."""
        self._recorded()

    def _step(self) -> None:
        self._differentiate()
        if self._ranks.count > 1:
            for descent in self._descents:
                descent.exchange(self._ranks)
        self._apply()
