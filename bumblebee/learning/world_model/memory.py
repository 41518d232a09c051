"""The last control steps of all worlds, in tensors that stay where they are."""

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from bumblebee.learning.world_model.body import name_of

_HELD_OUT = 32  # one world in so many shows what the model predicts in worlds that it never learned from
_WORDS = {
    "target": "servo target [rad]",
    "before": "earlier servo targets [rad]",
    "action": "the policy's last output",
    "earlier": "the policy's output before its last",
}


@dataclass(frozen=True)
class Windows:
    """Stretches of K control steps of B worlds."""

    bodies: Tensor
    """(K + 1, B, 13 + 2 J) states, the first before the first step."""
    targets: Tensor
    """(K, B, J) [rad] that the servos were given."""
    before: Tensor
    """(B, P J) [rad] the P before these, the last one first."""
    context: Tensor
    """(B, C)."""
    valid: Tensor
    """(K, B) bool: this step and those before it in the window led to the state after them."""


@dataclass(frozen=True)
class Starts:
    """Where B imagined rollouts begin."""

    body: Tensor
    before: Tensor
    action: Tensor
    """(B, J) the policy's last output."""
    earlier: Tensor
    """(B, J) its output before that."""
    clip: Tensor
    frame: Tensor
    context: Tensor


class Memory:
    """A ring of T control steps of N worlds, of which one in 32, at least one, is held out: no window is of these.

    Args:
        steps: T.
        context: (N, C), in what the worlds differ.
        joints: J.
        past: P, servo targets before a step's own that are kept with it.
    """

    def __init__(self, steps: int, context: Tensor, joints: int, past: int = 1) -> None:
        n, device = len(context), context.device
        self.steps, self.worlds, self.context = steps, n, context
        out = max(n // _HELD_OUT, 1)
        held = torch.zeros(n, dtype=torch.bool)
        held[(2 * torch.arange(out) + 1) * n // (2 * out)] = True  # spread evenly, as the exploration is
        self.held_out, self.learned = (rows.flatten().to(device) for rows in (held.nonzero(), (~held).nonzero()))
        sizes = {"body": 13 + 2 * joints, "before": past * joints}
        sizes |= dict.fromkeys(("target", "action", "earlier"), joints)
        self.columns = {name: torch.zeros(steps, n, size, device=device) for name, size in sizes.items()}
        self.clip, self.frame = (torch.zeros(steps, n, dtype=torch.long, device=device) for _ in range(2))
        self.broken = torch.ones(steps, n, dtype=torch.bool, device=device)
        self.oldest = torch.zeros((), dtype=torch.long, device=device)
        self.added = 0

    @property
    def full(self) -> bool:
        """Whether every step of the ring has been written."""
        return self.added >= self.steps

    def begin(self, clip: Tensor, frame: Tensor, **columns: Tensor) -> None:
        """Write what is known before a control step, (N, ...) each, over the oldest."""
        for name, value in columns.items():
            self.columns[name][self._at] = value
        self.clip[self._at], self.frame[self._at] = clip, frame

    def end(self, broken: Tensor) -> None:
        """Finish the step; the next state is not what it led to where it is `broken` (N,) bool: reset or pushed."""
        self.broken[self._at] = broken
        self.added += 1
        self.oldest.fill_(self._at)

    def state_dict(self) -> dict[str, Any]:
        """All that was written."""
        tensors = {name: tensor.cpu() for name, tensor in self._written().items()}
        return {"added": self.added, "tensors": tensors}

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self.added = saved["added"]
        for name, tensor in self._written().items():
            tensor.copy_(saved["tensors"][name])

    def fault(self) -> str | None:
        """Which world holds what that is no number, if any does, in words."""
        for name, column in self.columns.items():
            if not column.isfinite().all():
                step, world, entry = (int(n) for n in (~column.isfinite()).nonzero()[0])
                what = name_of(entry, column.shape[-1]) if name == "body" else f"{_WORDS[name]}, entry {entry}"
                clip, frame = int(self.clip[step, world]), int(self.frame[step, world])
                return f"{float(column[step, world, entry])} in world {world}, {what} (clip {clip}, frame {frame})"
        return None

    def _written(self) -> dict[str, Tensor]:
        rest = {"clip": self.clip, "frame": self.frame, "broken": self.broken, "oldest": self.oldest}
        return self.columns | rest

    @property
    def _at(self) -> int:
        return self.added % self.steps

    def windows(self, size: int, batch: int) -> Windows:
        """Draw stretches of `size` steps, of no world that is held out."""
        step = torch.randint(self.steps - size, (batch,), device=self.broken.device)
        drawn = torch.randint(len(self.learned), (batch,), device=self.broken.device)
        return self._windows(size, step, self.learned[drawn])

    def held_out_windows(self, size: int) -> Windows:
        """All stretches of `size` steps of the worlds that are held out."""
        step = torch.arange(self.steps - size, device=self.broken.device)
        return self._windows(size, step.repeat(len(self.held_out)), self.held_out.repeat_interleave(len(step)))

    def _windows(self, size: int, step: Tensor, world: Tensor) -> Windows:
        """Stretches of `size` steps from a step (B,) of a world (B,)."""
        rows = torch.stack([self._row(step + k, world) for k in range(size + 1)])  # (K + 1, B)
        broken = self.broken.flatten()[rows[:-1]]
        return Windows(
            bodies=self._of("body", rows),
            targets=self._of("target", rows[:-1]),
            before=self._of("before", rows[0]),
            context=self.context[world],
            valid=broken.cumsum(0) == 0,
        )

    def starts(self, batch: int) -> Starts:
        """Draw states to imagine from."""
        step = torch.randint(self.steps, (batch,), device=self.broken.device)
        world = torch.randint(self.worlds, (batch,), device=self.broken.device)
        rows = self._row(step, world)
        body, before, action, earlier = (self._of(name, rows) for name in ("body", "before", "action", "earlier"))
        return Starts(
            body, before, action, earlier, self.clip.flatten()[rows], self.frame.flatten()[rows], self.context[world]
        )

    def _row(self, step: Tensor, world: Tensor) -> Tensor:
        """Flat index of steps counted from the oldest, of a full ring."""
        return (self.oldest + step) % self.steps * self.worlds + world

    def _of(self, name: str, rows: Tensor) -> Tensor:
        return self.columns[name].flatten(0, 1)[rows]
