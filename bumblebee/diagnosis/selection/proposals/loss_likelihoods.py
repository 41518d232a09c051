"""How likely shares and patterns of lost commands are, given what each pattern leaves unexplained in each window."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bumblebee.diagnosis.thresholds.proposals import PacketLoss

_HALF = 1.92  # half of a chi-square's 95 % quantile: fall of the log-likelihood at the ends of a 95 % interval


@dataclass(frozen=True, eq=False)
class LossLikelihoods:
    """Likelihoods of W windows under the P patterns of their T ticks."""

    patterns: np.ndarray
    """(P, T) bool, the first without a loss."""
    logs: np.ndarray
    """(W, P) log-likelihood of each pattern, less that of none."""
    rule: PacketLoss = field(default_factory=PacketLoss)
    """How a share is sought."""
    changes: np.ndarray | None = None
    """(L, T, W, M) what single losses and runs of them do."""

    def total(self, share: float) -> float:
        """Log-likelihood of a share, summed over windows."""
        posterior = self.logs + self._prior(share)
        most = posterior.max(axis=1)
        return float((most + np.log(np.exp(posterior - most[:, None]).sum(axis=1))).sum())

    @cached_property
    def best(self) -> float:
        """The share of largest likelihood, by expectation and maximisation."""
        share = self.rule.first_share
        for _ in range(self.rule.iterations):
            before, weights = share, self._weights(share)
            share = float(np.clip((weights @ self._lost).mean() / self.patterns.shape[1], 1e-6, 0.9))
            if share == before:
                break
        return share

    def interval(self, share: float) -> tuple[float, float]:
        """Shares between which the log-likelihood is within 1.92 of its maximum."""
        grid = np.unique(np.concatenate((np.geomspace(1e-5, 0.9, 160), [share])))
        inside = grid[np.array([self.total(p) for p in grid]) > self.total(share) - _HALF]
        return float(inside[0]), float(inside[-1])

    def likely(self, share: float) -> np.ndarray:
        """(W, T) bool: the most likely pattern of each window."""
        return self.patterns[np.argmax(self.logs + self._prior(share), axis=1)]

    def price(self, share: float) -> float:
        """Less the log-probability of each window's most likely pattern, summed: what it says beside the share."""
        which = np.argmax(self.logs + self._prior(share), axis=1)
        return -float(self._prior(share)[which].sum())

    @cached_property
    def _lost(self) -> np.ndarray:
        return self.patterns.sum(axis=1)

    def _prior(self, share: float) -> np.ndarray:
        return self._lost * np.log(share) + (self.patterns.shape[1] - self._lost) * np.log1p(-share)

    def _weights(self, share: float) -> np.ndarray:
        posterior = self.logs + self._prior(share)
        weights = np.exp(posterior - posterior.max(axis=1, keepdims=True))
        return weights / weights.sum(axis=1, keepdims=True)
