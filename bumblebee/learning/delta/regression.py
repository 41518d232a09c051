"""Fits a delta action by regression: which correction makes the simulator end a few control steps where the robot did?

The paper trains the correction by PPO on rewards of a whole replayed episode (section 3.3.2). What one correction does
to the next few steps is known better from the simulator itself: it is stepped from recorded states with none and with
each joint's target moved up and down, about as far as a correction may have to move it. The correction, linear in what
the delta action sees, follows from weighted least squares, and again around itself: docs/decisions/delta-action.md.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from bumblebee.learning.delta.action import (
    DeltaAction,
    DeltaConfig,
    RegressionConfig,
    correction,
    make_network,
    observe,
    placement,
)
from bumblebee.learning.delta.env import restart
from bumblebee.learning.delta.least_squares import System, misfit, solve
from bumblebee.learning.delta.recordings import Recordings, recorded_state
from bumblebee.sim.engine import Engine, RobotState
from bumblebee.sim.rotations import conjugate, multiply, rotate_inverse

FINEST = (1e-3, 2e-2)
"""Misfits of positions [m, rad] and velocities [m/s, rad/s] below which none counts more than another."""
_NO_MISFIT = 1e-12
_COMMON = 1.5
"""Multiple of the median misfit of a window beyond which it counts less (Huber)."""


@dataclass(frozen=True)
class Windows:
    """N short replays from recorded states; M quantities of the robot's state at their end, A corrected joints."""

    seen: Tensor
    """(N, D) what the delta action saw, mean over the window."""
    before: Tensor
    """(N, D) the same as it was recorded a control step earlier, but for the targets; see `_system`."""
    missed: Tensor
    """(N, M) recording less simulator, see `off`."""
    effect: Tensor
    """(N, M, A) change of the simulator's end for each radian of correction, held throughout the window: a secant."""
    owner: Tensor
    """(N,) index of the motion."""

    def __getitem__(self, which: Tensor) -> "Windows":
        """Some of them."""
        rest = (self.missed[which], self.effect[which], self.owner[which])
        return Windows(self.seen[which], self.before[which], *rest)


def fit_delta(
    engine: Engine,
    recordings: Recordings,
    config: DeltaConfig,
    encoder_offset: Tensor,
    report: Callable[[int, str], None] = lambda frames, note: None,
) -> tuple[DeltaAction, pd.DataFrame]:
    """Fit the correction; none at all where rollouts that took no part do not bear it out.

    Args:
        engine: the simulator that is corrected.
        recordings: training rollouts only.
        config: see `DeltaConfig.regression`.
        encoder_offset: (J,) [rad] what the encoders add, taken off a recording before it becomes a state.
        report: called with control steps of all robots since the last call, and a short note.

    Returns:
        The delta action and a row for each pass: pass, left (share of the squared misfit at the windows' ends that is
        left on the rollouts fitted, before the pass), and of the first pass' correction on rollouts that took no part
        held_out (the same), held_out_se (its standard error over folds), ridge and nudge.
    """
    own = config.regression
    recordings = recordings.to(engine.device)
    rows = _drawn(recordings, own, config.seed)
    nothing = DeltaAction(make_network((), len(config.joints)), config.joints, config.limit)

    def replayed(delta: DeltaAction | None, nudge: float) -> Windows:
        return _kept(replay(engine, recordings, rows, config, encoder_offset, delta, nudge, report))

    tried = {nudge: replayed(None, nudge) for nudge in own.nudges}
    if not all(len(windows.seen) for windows in tried.values()):
        told = {"held_out": 1.0, "held_out_se": 0.0, "ridge": 0.0, "nudge": own.nudges[0]}
        return nothing, pd.DataFrame([{"pass": 1, "left": 1.0, **told}])
    first = tried[own.nudges[0]]
    scale = torch.maximum(first.missed.abs().median(dim=0).values, _finest(len(recordings.qvel[0]) - 6))
    delta = copy.deepcopy(nothing)
    delta.normaliser.fit(first.seen)
    systems = {nudge: _system(delta, windows, scale) for nudge, windows in tried.items()}
    (held_out, error, ridge), nudge = min((_cross_validated(system, own), n) for n, system in systems.items())
    system, told = systems[nudge], {"held_out": held_out, "held_out_se": error, "ridge": ridge, "nudge": nudge}
    table = [{"pass": 1, "left": 1.0, **told}]
    if 1.0 - held_out <= own.evidence * error:
        return delta, pd.DataFrame(table)
    _put(delta, solve(system, ridge))
    before = _size(system)
    for number in range(2, own.passes + 1):
        windows = replayed(delta, nudge)
        if not len(windows.seen):
            return nothing, pd.DataFrame(table)
        system = _system(delta, windows, scale)
        table.append({"pass": number, "left": _size(system) / before, **told})
        _put(delta, solve(_added(delta, system, windows.seen), ridge))
    return delta, pd.DataFrame(table)


def frames(config: DeltaConfig) -> int:
    """Control steps that `fit_delta` takes at most, of all robots."""
    own = config.regression
    return (own.passes - 1 + len(own.nudges)) * own.windows * own.steps * (1 + 2 * len(config.joints))


def off(state: RobotState, qpos: Tensor, qvel: Tensor) -> Tensor:
    """(B, M) recording less simulator: the base's position [m], rotation [rad] and velocities in its own frame, joints.

    Args:
        state: of the simulator.
        qpos: (B, 7 + J) recorded position [m, rad].
        qvel: (B, 6 + J) recorded velocity [m/s in the world, rad/s in the base, rad/s].
    """
    quat = qpos[:, 3:7]
    turn = multiply(conjugate(state.root_quat_w), quat)
    turn = torch.where(turn[:, :1] < 0, -turn, turn)
    parts = (
        rotate_inverse(quat, qpos[:, :3] - state.root_pos_w),
        2.0 * turn[:, 1:],
        rotate_inverse(quat, qvel[:, :3]) - state.root_lin_vel_b,
        qvel[:, 3:6] - state.root_ang_vel_b,
        qpos[:, 7:] - state.joint_pos,
        qvel[:, 6:] - state.joint_vel,
    )
    return torch.cat(parts, dim=-1)


def replay(
    engine: Engine,
    recordings: Recordings,
    rows: Tensor,
    config: DeltaConfig,
    encoder_offset: Tensor,
    delta: DeltaAction | None,
    nudge: float,
    report: Callable[[int, str], None] = lambda frames, note: None,
) -> Windows:
    """Step the simulator from each of the rows (N,), with `delta` and each correction `nudge` [rad] up and down."""
    device, steps = engine.device, config.regression.steps
    place, offset = placement(config.joints).to(device), encoder_offset.to(device)
    there = None if delta is None else delta.on(device)
    moves = torch.cat([torch.zeros_like(place[:1]), nudge * place, -nudge * place])
    parts: list[tuple[Tensor, Tensor, Tensor, Tensor]] = []
    for begin in range(0, len(rows), engine.num_worlds):
        own = rows[begin : begin + engine.num_worlds]
        filled = torch.cat([own, own[-1:].expand(engine.num_worlds - len(own))])
        ends: list[Tensor] = []
        seen: list[Tensor] = []
        for moved in moves:
            restart(engine, recordings, torch.arange(engine.num_worlds, device=device), filled, offset)
            for k in range(steps):
                targets, state = recordings.targets[filled + k], engine.state()
                if not ends:
                    seen.append(observe(state, targets))
                engine.step((targets if there is None else there(state, targets)) + moved)
            last = filled + steps
            ends.append(off(engine.state(), recordings.qpos[last], recordings.qvel[last])[: len(own)].cpu())
            report(len(own) * steps, "")
        mean = torch.stack(seen).mean(dim=0)[: len(own)].cpu()
        up, down = ends[1 : len(place) + 1], ends[len(place) + 1 :]
        effect = torch.stack([(low - high) / (2.0 * nudge) for high, low in zip(up, down, strict=True)], dim=-1)
        targets = torch.stack([recordings.targets[own + k] for k in range(steps)]).mean(dim=0)
        before = observe(recorded_state(recordings, own - 1), targets).cpu()
        parts.append((mean, before, ends[0], effect))
    shown, before, missed, effect = (torch.cat(own).double() for own in zip(*parts, strict=True))
    return Windows(shown, before, missed, effect, recordings.motion(rows).cpu())


def _cross_validated(system: System, own: RegressionConfig) -> tuple[float, float, float]:
    """Share of the misfit left on motions that took no part, its standard error over folds, and the ridge for it.

    A fold is a run of motions, each with all of its rollouts.
    """
    fold = system.owner * own.folds // (int(system.owner.max()) + 1)
    present = [k for k in range(own.folds) if 0 < int((fold == k).sum()) < len(fold)]
    if len(present) < 2:
        return 1.0, 0.0, own.ridges[-1]
    found = []
    for ridge in own.ridges:
        shares = []
        for k in present:
            learnt = solve(system[fold != k], ridge)
            after, before = (misfit(system[fold == k], theirs) for theirs in (learnt, torch.zeros_like(learnt)))
            shares.append(after / before if before > 0.0 else 1.0)
        found.append((float(np.mean(shares)), float(np.std(shares, ddof=1) / np.sqrt(len(shares))), ridge))
    return min(found)


def _drawn(recordings: Recordings, own: RegressionConfig, seed: int) -> Tensor:
    """First rows of the windows, all or as many as are drawn, in their order."""
    rows = recordings.windows(own.steps, stride=1)
    rows = rows[rows > recordings.start[recordings.owner(rows)]]
    order = torch.randperm(len(rows), generator=torch.Generator().manual_seed(seed))[: own.windows]
    return rows[order.sort().values.to(rows.device)]


def _finest(joints: int) -> Tensor:
    """(M,) the smallest scale of each quantity in `off`."""
    position, velocity = FINEST
    return torch.tensor([position] * 6 + [velocity] * 6 + [position] * joints + [velocity] * joints).double()


def _kept(windows: Windows) -> Windows:
    """Those in which nothing blew up."""
    return windows[torch.isfinite(windows.missed).all(dim=1) & torch.isfinite(windows.effect).all(dim=(1, 2))]


def _system(delta: DeltaAction, windows: Windows, scale: Tensor) -> System:
    """The windows in units of `scale` (M,), those that miss by far more than most with less weight.

    Features are the readings of a control step before: what noise there is in those that a window starts from, the
    simulator carries to its end, and a correction learnt from them would be one of the noise.
    """
    features = _features(delta, windows.before)
    missed = windows.missed / scale
    size = missed.square().mean(dim=1).sqrt()
    weight = (_COMMON * size.median().clamp(min=_NO_MISFIT) / size.clamp(min=_NO_MISFIT)).clamp(max=1.0)
    return System(features, missed, windows.effect / scale[:, None], weight, windows.owner)


def _size(system: System) -> float:
    """Mean weighted squared misfit."""
    return float((system.weight * system.missed.square().mean(dim=1)).mean())


def _features(delta: DeltaAction, seen: Tensor) -> Tensor:
    """(N, D + 1) normalised, and 1."""
    normaliser = delta.normaliser
    scaled = (seen - normaliser.mean.double()) / normaliser.std.double()
    return torch.cat([scaled, torch.ones(len(seen), 1, dtype=scaled.dtype)], dim=1)


def _added(delta: DeltaAction, system: System, seen: Tensor) -> System:
    """The problem whose answer is the whole correction, from one around what `delta` corrects already."""
    layer = _linear(delta)
    made = _features(delta, seen) @ torch.cat([layer.weight, layer.bias[:, None]], dim=1).double().T
    made = correction(made, delta.limit)
    return replace(system, missed=system.missed + torch.einsum("nma,na->nm", system.effect, made))


def _linear(delta: DeltaAction) -> torch.nn.Linear:
    layer = delta.network[1]
    assert isinstance(layer, torch.nn.Linear)
    return layer


def _put(delta: DeltaAction, coefficients: Tensor) -> None:
    layer = _linear(delta)
    with torch.no_grad():
        layer.weight.copy_(coefficients[:-1].T)
        layer.bias.copy_(coefficients[-1])
