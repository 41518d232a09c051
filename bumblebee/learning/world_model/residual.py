"""A learned residual: what a world model of the simulator still misses of the robot, for which no effect has a name.

It is added to the change that the model predicts, starts at zero, and learns from measured rollouts alone. On states of
the simulator it is held to zero, so that it corrects next to nothing where nothing was measured. Whether it is kept is
decided as for a delta action, by rollouts that took no part: docs/decisions/measured-loop-in-the-model.md.
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import torch
from torch import Tensor, nn

from bumblebee.learning.delta import Gain, by_rollout, compare, state_error
from bumblebee.learning.world_model.accuracy import HORIZONS
from bumblebee.learning.world_model.body import joint_pos
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.measured import Measured
from bumblebee.learning.world_model.memory import Memory
from bumblebee.ranges import Count, Factor, Few, Range, Ranged, Rate, Widths

_STRIDE = 25  # control steps between the windows that judge, as for the delta action


@dataclass(frozen=True)
class ResidualConfig(Ranged):
    """The fit of a residual."""

    hidden: Widths = (128, 128)
    """Widths of its layers, SiLU."""
    window: Annotated[int, Range(least=1, most=1000)] = 30
    """Control steps that are predicted in a row."""
    batch: Annotated[int, Range(least=1, most=1_000_000)] = 256
    """Measured windows of a gradient step, and simulated states."""
    updates: Count = 2000
    """Gradient steps at most."""
    rate: Rate = 3e-4
    """Adam's learning rate."""
    quiet: Factor = 0.01
    """Weight of the residual's mean square on simulated states, in units of the changes that the model learned from."""
    check_every: Count = 50
    """Gradient steps between looks at the rollouts that stop the fit."""
    patience: Few = 6
    """Looks without an improvement after which the fit stops."""


class Summed(nn.Module):
    """Layers of a model and a residual on the same input."""

    def __init__(self, layers: nn.Module, residual: nn.Module) -> None:
        super().__init__()
        self.layers, self.residual = layers, residual

    def forward(self, seen: Tensor) -> Tensor:
        """Changes (B, 12 + 2 J) in the model's units of normalised inputs (B, D)."""
        return self.layers(seen) + self.residual(seen)


@dataclass(frozen=True)
class Fitted:
    """A residual, how it was fitted, and what it is worth."""

    residual: nn.Sequential
    updates: int
    """Gradient steps until the best look; 0: rollouts that took no part in the steps bore none of them out."""
    stop: tuple[float, float]
    """Loss on the rollouts that stop the fit, without the residual and with it."""
    gain: Gain
    """On rollouts that judge, against the model without it."""

    @property
    def kept(self) -> nn.Sequential | None:
        """The residual, or None where it does not lower the held-out error beyond the interval."""
        return self.residual if self.gain.promoted else None


def new_residual(model: Dynamics, hidden: Sequence[int]) -> nn.Sequential:
    """An untrained residual for a model: its output is zero."""
    size, layers = len(model.mean), []
    for width in hidden:
        layers += [nn.Linear(size, width), nn.SiLU()]
        size = width
    last = nn.Linear(size, len(model.scale))
    nn.init.zeros_(last.weight)
    nn.init.zeros_(last.bias)
    return nn.Sequential(*layers, last).to(model.mean.device)


def corrected(model: Dynamics, residual: nn.Module | None) -> Dynamics:
    """The model with a residual, on the same numbers from now on; only the residual's weights may want a gradient."""
    twin = model.frozen()
    if residual is not None:
        twin.layers = Summed(twin.layers, residual)
    return twin


def fit_residual(
    model: Dynamics,
    learn: Measured,
    stop: Measured,
    judge: Measured,
    simulated: Memory,
    config: ResidualConfig,
    seed: int = 0,
) -> Fitted:
    """Fit, stop and judge a residual, each on rollouts of their own.

    Args:
        model: what it is added to; it stays as it is.
        learn: measured windows that gradients come from.
        stop: those of which the loss decides when the fit ends.
        judge: those that decide whether the residual is kept.
        simulated: control steps of the simulator that the model learned from, a full memory.
        config: see `ResidualConfig`.
        seed: of the network and of the draws.
    """
    torch.manual_seed(seed)
    residual = new_residual(model, config.hidden)
    whole, context = corrected(model, residual), simulated.context.shape[1]
    past = simulated.columns["before"].shape[-1] // simulated.columns["target"].shape[-1]
    adam = torch.optim.Adam(residual.parameters(), lr=config.rate)
    drawn = learn.first_rows(config.window, past)
    looks = stop.first_rows(config.window, past, stride=max(config.window // 2, 1))
    best, kept, at, first = float("inf"), deepcopy(residual.state_dict()), 0, float("nan")
    for update in range(config.updates + 1):
        if update % config.check_every == 0:
            with torch.no_grad():
                loss = float(_loss(whole, stop, looks, config.window, past, context))
            first = loss if update == 0 else first
            if loss < best:
                best, kept, at = loss, deepcopy(residual.state_dict()), update
            if update - at >= config.patience * config.check_every:
                break
        rows = drawn[torch.randint(len(drawn), (config.batch,), device=drawn.device)]
        own = simulated.windows(1, config.batch)
        quiet = residual(model.normalised(own.bodies[0], own.targets[0], own.before, own.context)).square().mean()
        loss = _loss(whole, learn, rows, config.window, past, context) + config.quiet * quiet
        adam.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(residual.parameters(), 1.0)
        adam.step()
    residual.load_state_dict(kept)
    residual.requires_grad_(False)
    without, with_it = (predicted_error(one, judge, past, context) for one in (model, whole))
    return Fitted(residual, at, (first, best), compare(without, with_it, judge.recordings.motions))


def _loss(model: Dynamics, own: Measured, rows: Tensor, steps: int, past: int, context: int) -> Tensor:
    window = own.windows(rows, steps, past, context)
    predicted = model.unrolled(window.bodies[0], window.targets, window.before, window.context)
    return model.loss(predicted, window.bodies[1:], window.valid)


@torch.no_grad()
def predicted_error(model: Dynamics, own: Measured, past: int = 1, context: int = 0) -> dict[str, np.ndarray]:
    """State error of each stretch after each of `HORIZONS`, (R,) [rad], as `delta.replay_error` gives a simulator's.

    Args:
        model: what predicts from measured states, by the targets that the robot was given.
        own: measured stretches.
        past: P, earlier targets that the model is shown.
        context: C, entries of the model's context.
    """
    found = {}
    for horizon in HORIZONS:
        steps = round(horizon / model.dt)
        rows = own.first_rows(steps, past, _STRIDE)
        window = own.windows(rows, steps, past, context)
        end = model.unrolled(window.bodies[0], window.targets, window.before, window.context)[-1]
        errors = state_error(end[:, 3:7], joint_pos(end), own.recordings.qpos[rows + steps])
        owner = own.recordings.owner(rows).cpu().numpy()
        found[str(horizon)] = by_rollout(errors.cpu().numpy(), owner, len(own.recordings.ids))
    return found
