"""The rollout of a policy on its reference motions in a simulator whose true state is known, and its judge.

`learning/trial.py` tries policies before and after a training with it; policies that are compared are judged by
`learning/three_rules.py`. What runs on readings with noise and writes logs, as a robot does, is `policy/episodes.py`.
All end by `tracking/terminations.py`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from bumblebee.learning.policy import Policy
from bumblebee.motion.clip import Clip
from bumblebee.sim.engine import Engine, RobotState
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.env import ActionAdapter
from bumblebee.tracking.observing.groups import Group
from bumblebee.tracking.observing.observations import action_middle, action_scale, middle_targets
from bumblebee.tracking.rows import Rows
from bumblebee.tracking.sampling.library import MotionLibrary, ReferenceFrame
from bumblebee.tracking.sampling.starts import start_state
from bumblebee.tracking.terminations import fallen, success_threshold


@dataclass(frozen=True)
class Manner:
    """How a policy is run: what it is shown, and the factor [rad] on its actions, one for all or our own by joint."""

    seen: ObservationConfig
    scale: float | None = None
    noise: float = 0.0
    """Factor on the noise of the start and of the sensors."""
    adapter: ActionAdapter | None = None
    """Between the policy's action and the motors', such as a delta action."""


@dataclass(frozen=True)
class Tick:
    """A control step of N robots."""

    state: RobotState
    """The true one after the step."""
    ref: ReferenceFrame
    """The reference of the same moment."""
    running: Tensor
    """(N,) bool, whose clip is not over."""
    unstable: Tensor
    """(N,) bool, whose state stopped being a number."""


def roll_out(
    policy: Callable[[Tensor], Tensor],
    manner: Manner,
    library: MotionLibrary,
    engine: Engine,
    generator: torch.Generator | None = None,
    starts: Tensor | None = None,
) -> Iterator[Tick]:
    """Let a policy follow each of the library's N motions to its end, deterministic; whoever iterates may stop sooner.

    Args:
        policy: a `Policy`, which remembers each rollout from its start if it has a memory, or a function of the
            observation (N, D) whose actions are around the reference.
        manner: how it is run.
        library: the motions.
        engine: N robots; they are put at the start.
        generator: of the noise.
        starts: (N,) frames to start at; the first ones without.
    """
    n, dt, generator = len(library), engine.control_dt, generator or torch.Generator()
    ids, begin = torch.arange(n), torch.zeros(n) if starts is None else starts
    scale = action_scale() if manner.scale is None else torch.full((library.num_joints,), manner.scale)
    act, middle = policy, None
    if isinstance(policy, Policy):
        act, middle = policy.follower(), action_middle(policy.shape.action)
    group = Group(manner.seen, (n, library.num_joints, len(library.ahead)), manner.noise, engine.device)
    first = library.frames(ids, begin * dt)
    engine.reset(ids, *start_state(first, manner.noise, generator), first.hold_pos)
    engine.settle()
    action = torch.zeros(n, library.num_joints)
    for frame in range(int((library.length - begin).max()) - 1):
        ref = library.frames(ids, (begin + frame + 1) * dt)
        state = engine.state()
        group.look(state, ref, action, Rows(torch.full((n,), frame == 0), by_mask=False), generator)
        action = act(group.noisy)
        zero = middle_targets(ref, middle)
        motor = action if manner.adapter is None else manner.adapter(state, zero, action)
        engine.step(zero + scale * motor)
        yield Tick(engine.state(), ref, begin + frame + 1 < library.length, engine.unstable())


class Judge:
    """Keeps which of N robots have never lost their clip, and the errors before that.

    A clip is lost where a key body is farther from its reference than the family's threshold, or the robot has fallen.
    """

    def __init__(self, clips: Sequence[Clip]) -> None:
        n = len(clips)
        self.limit = torch.tensor([success_threshold(clip) for clip in clips])
        """(N,) [m]."""
        self.kept = torch.ones(n, dtype=torch.bool)
        """(N,) bool."""
        self.frames, self._joint, self._key = torch.zeros(3, n).unbind()

    def see(self, tick: Tick) -> Tensor:
        """Take in a control step; which robots (N,) bool are kept and have something left to follow."""
        down = fallen(tick.state, tick.ref) | tick.unstable
        distances = (tick.state.key_pos_w - tick.ref.key_pos_w).norm(dim=-1)
        self.kept &= ((distances.amax(-1) <= self.limit) & ~down) | ~tick.running
        going = self.kept & tick.running
        self.frames += going
        self._key += torch.where(going, distances.mean(-1), 0.0)
        self._joint += torch.where(going, (tick.state.joint_pos - tick.ref.joint_pos).abs().mean(-1), 0.0)
        return going

    @property
    def joint_error(self) -> Tensor:
        """(N,) mean |q - q_ref| over joints and the frames before the loss [rad]."""
        return self._joint / self.frames.clamp(min=1)

    @property
    def key_error(self) -> Tensor:
        """(N,) mean distance of the key bodies over the same frames [m]."""
        return self._key / self.frames.clamp(min=1)
