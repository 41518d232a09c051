"""Deterministic variation: every clip has its own stream of random numbers, named by seed, variant and kind."""

import hashlib

import numpy as np


class Vary:
    """`vary(x)` is x changed by up to a share; the stream depends on nothing but seed, variant and name."""

    def __init__(self, seed: int, variant: int, name: str, share: float) -> None:
        digest = hashlib.sha256(f"{seed}/{variant}/{name}".encode()).digest()
        self._random = np.random.default_rng(int.from_bytes(digest[:8], "little"))
        self._share = share

    def __call__(self, value: float, share: float = 1.0) -> float:
        """`value` times 1 +- the share, which `share` scales."""
        return float(value * (1 + self._share * share * self._random.uniform(-1, 1)))
