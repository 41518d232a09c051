"""Gradient steps on some weights, in tensors that stay where they are, so that a step can be recorded."""

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn

_LOWEST = 0.1  # of the learning rate, at the end of its cosine


class Descent:
    """Adam at a rate that falls along a cosine, with bounded gradients.

    Args:
        weights: what learns, all on one device.
        rate: learning rate at first.
        grad_norm: gradients are scaled down to this norm.
    """

    def __init__(self, weights: Sequence[nn.Parameter], rate: float, grad_norm: float) -> None:
        self.weights, self._first, self._norm = list(weights), rate, grad_norm
        device = self.weights[0].device
        self.rate = torch.tensor(rate, device=device)
        self._adam = torch.optim.Adam(self.weights, lr=self.rate, fused=True, capturable=device.type == "cuda")
        self._gradients = [torch.zeros_like(weight) for weight in self.weights]
        for weight, gradient in zip(self.weights, self._gradients, strict=True):
            weight.grad = gradient

    def decay(self, done: float) -> None:
        """Set the rate for a training of which the share `done` lies behind."""
        self.rate.fill_(self._first * (_LOWEST + (1 - _LOWEST) * 0.5 * (1 + math.cos(math.pi * done))))

    def __call__(self, loss: Tensor) -> None:
        """One step down the gradient of `loss` ()."""
        torch._foreach_copy_(self._gradients, torch.autograd.grad(loss, self.weights))
        torch.nn.utils.clip_grad_norm_(self.weights, self._norm)
        self._adam.step()

    def state_dict(self) -> dict[str, Any]:
        """State of the optimiser, beside weights and rate."""
        return self._adam.state_dict()

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self._adam.load_state_dict(saved)
        for group in self._adam.param_groups:
            group["lr"] = self.rate
