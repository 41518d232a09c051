"""The input of a peer's policy, block by block as its contract says, with the history that it needs."""

from collections.abc import Callable

import torch
from torch import Tensor

from bumblebee.peers.contract import Block, PeerContract, Term
from bumblebee.peers.terms import TERMS, Seen
from bumblebee.sim.engine import RobotState
from bumblebee.tracking.sampling.library import ReferenceFrame

Reference = Callable[[int], ReferenceFrame]
"""The reference so many control steps after now, its joints in the contract's order."""


class Observer:
    """Input of B robots that began their motions together, step by step.

    Args:
        contract: what the input holds.
    """

    def __init__(self, contract: PeerContract) -> None:
        self.contract = contract
        self._default = torch.tensor(contract.default_pos, dtype=torch.float32)
        shown = [[joint not in term.zero for joint in contract.joints] for term in self._every()]
        self._shown = {id(term): torch.tensor(row) for term, row in zip(self._every(), shown, strict=True)}
        self._past: list[Tensor | None] = [None for _ in contract.input]

    def see(self, state: RobotState, reference: Reference, last_action: Tensor) -> Tensor:
        """Input (B, width) of this control step, which then belongs to the past.

        Args:
            state: the robots, joints in the contract's order.
            reference: the motions.
            last_action: (B, J) output of the step before, as the contract says that it is remembered.
        """
        frames: dict[int, ReferenceFrame] = {}
        values: dict[int, Tensor] = {}
        for term in self._every():
            if term.step not in frames:
                frames[term.step] = reference(term.step)
            seen = Seen(state, frames[term.step], last_action, self._default)
            values[id(term)] = self._value(term, seen)
        return torch.cat([self._block(i, block, values) for i, block in enumerate(self.contract.input)], dim=1)

    def _every(self) -> list[Term]:
        return [term for terms in self.contract.groups.values() for term in terms]

    def _value(self, term: Term, seen: Seen) -> Tensor:
        kind = TERMS[term.term]
        value = term.scale * kind.value(seen)
        if kind.size == len("xyz"):
            return value[:, ["xyz".index(axis) for axis in term.axes]]
        return value * self._shown[id(term)] if term.zero else value

    def _block(self, index: int, block: Block, values: dict[int, Tensor]) -> Tensor:
        """Values (B, steps x size) of a block; this step joins its past."""
        terms = list(self.contract.terms(block))
        now = torch.cat([values[id(term)] for term in terms], dim=1)[:, None]  # (B, 1, size)
        past = self._past[index]
        if past is None:
            first = now if block.begin == "first" else torch.zeros_like(now)
            past = first.expand(-1, block.past, -1)
        every = torch.cat((past, now), dim=1)  # oldest first
        self._past[index] = every[:, 1:]
        steps = every if block.now else past
        steps = steps.flip(1) if block.order == "newest_first" else steps
        if block.stacked == "by_step":
            return steps.flatten(1)
        sizes = [values[id(term)].shape[1] for term in terms]
        return torch.cat([part.flatten(1) for part in steps.split(sizes, dim=2)], dim=1)
