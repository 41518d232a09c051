"""The weighted least squares of a correction that is linear in features and acts through a known influence."""

from dataclasses import dataclass

import torch
from torch import Tensor

LEAST = 1e-12
"""Damping where no correction has any influence: the answer is then none."""


@dataclass(frozen=True)
class System:
    """A weighted linear problem: missed (N, M) = effect (N, M, A) @ (features (N, F) @ coefficients (F, A))."""

    features: Tensor
    missed: Tensor
    effect: Tensor
    weight: Tensor
    """(N,) of each window, at most 1."""
    owner: Tensor

    def __getitem__(self, which: Tensor) -> "System":
        """Some of the windows."""
        rest = (self.missed[which], self.effect[which], self.weight[which], self.owner[which])
        return System(self.features[which], *rest)


def solve(system: System, ridge: float) -> Tensor:
    """Coefficients (F, A) of the least weighted squares, with `ridge` times the mean diagonal added to it."""
    features, joints = system.features.shape[1], system.effect.shape[2]
    gram = torch.einsum("nma,nmb->nab", system.effect, system.effect) * system.weight[:, None, None]
    pull = torch.einsum("nma,nm->na", system.effect, system.missed) * system.weight[:, None]
    left = torch.zeros(features, joints, features, joints, dtype=gram.dtype)
    for a in range(joints):
        for b in range(a + 1):
            block = (system.features * gram[:, a, b, None]).T @ system.features
            left[:, a, :, b] = block
            left[:, b, :, a] = block
    matrix = left.reshape(features * joints, features * joints)
    damping = (ridge * torch.diagonal(matrix).mean()).clamp(min=LEAST)
    right = (system.features.T @ pull).reshape(-1)
    root = torch.linalg.cholesky(matrix + damping * torch.eye(len(matrix), dtype=matrix.dtype))
    return torch.cholesky_solve(right[:, None], root).reshape(features, joints)


def misfit(system: System, coefficients: Tensor) -> float:
    """Mean weighted squared misfit that the coefficients leave."""
    made = torch.einsum("nma,na->nm", system.effect, system.features @ coefficients)
    return float((system.weight * (system.missed - made).square().mean(dim=1)).mean())
