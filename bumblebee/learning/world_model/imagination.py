"""The task inside the world model: what a policy would earn in rollouts that the model imagines, with gradients.

Observation, reward and the ends of episodes are those of `bumblebee.tracking`, worked out from imagined states. The
model imagines no contact forces: `stumble` sees none. Torques are the declared servos' at the end of the step.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from bumblebee.learning.world_model.body import joint_pos, unpacked
from bumblebee.learning.world_model.dynamics import Dynamics, handed_on
from bumblebee.learning.world_model.memory import Starts
from bumblebee.robot.facts import FEET, KEY_BODIES, joint_names
from bumblebee.robot.model import build_model
from bumblebee.sim.engine import RobotState
from bumblebee.sim.servo import servos_of
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.forward_kinematics import ForwardKinematics
from bumblebee.tracking.observing.observations import middle_targets
from bumblebee.tracking.observing.terms import expanded, parts, see
from bumblebee.tracking.rewards import Step
from bumblebee.tracking.sampling.library import ReferenceFrame, over_robot
from bumblebee.tracking.terminations import fallen

Act = Callable[[Tensor], Tensor]
"""Observations (B, D) -> actions (B, J)."""


@dataclass(frozen=True)
class Rollout:
    """H imagined control steps of B robots."""

    seen: Tensor
    """(H, B, V) what the value sees before each step, exact and without gradients."""
    after: Tensor
    """(B, V) what it sees after the last step."""
    reward: Tensor
    """(H, B) a second of perfect tracking; 0 after an end."""
    alive: Tensor
    """(H + 1, B) bool: no end before this step, or after the last."""
    over: Tensor
    """(H, B) bool: the clip ends with this step, which is no failure."""

    @classmethod
    def of(cls, seen: Tensor, after: Tensor, reward: Tensor, lost: Tensor, left: Tensor) -> "Rollout":
        """From what the value sees, rewards and failures (H, B), and the steps (B,) that were left of the clips."""
        done = torch.arange(1, len(reward) + 1, device=left.device)[:, None]
        ends = torch.cat(((left <= 0)[None], lost | (done >= left)))
        alive = ends.cumsum(0) == 0
        return cls(seen, after, torch.where(alive[:-1], reward, 0.0), alive, alive[:-1] & (done >= left) & ~lost)


class Imagination:
    """The task of `env` on states of a world model.

    Args:
        env: whose settings, references and limits hold; its observation has no history.
        horizon: control steps of a rollout.
        compiled: whether torch compiles a control step.
    """

    def __init__(self, env: TrackingEnv, horizon: int, compiled: bool = False) -> None:
        device = torch.device(env.device)
        self.env, self.horizon = env, horizon
        self.terms = expanded((*env.cfg.observation.terms, *env.cfg.observation.now))
        self.beside = expanded(env.cfg.critic)
        every = (*env.cfg.observation.terms, *env.cfg.observation.now, *env.cfg.critic)
        self.value_size = sum(size for _, size in parts(every, env.num_actions, len(env.library.ahead)))
        """V, what the value sees: the policy's observation without noise, and the task's terms for the critic."""
        # Of the declared robot: a corrected model may have further hinges, which no state holds.
        self.kinematics = ForwardKinematics(build_model(), [*KEY_BODIES, *FEET], device)
        servos = servos_of(env.engine.model, [env.engine.model.joint(name).id for name in joint_names()])
        columns = (servos.gain, servos.bias[:, 2], servos.limit)
        self._kp, self._kd, self._limit = (torch.tensor(c, dtype=torch.float32, device=device) for c in columns)
        self._ahead = torch.arange(1, horizon + 2, device=device)
        self._advanced = torch.compile(self._advance, dynamic=False) if compiled else self._advance

    def state(self, body: Tensor) -> tuple[RobotState, Tensor]:
        """The task's view of states (B, 13 + 2 J), and the feet's orientations (B, 2, 4)."""
        place, turn = self.kinematics(body[:, :3], body[:, 3:7], joint_pos(body))
        return unpacked(body, place[:, : len(KEY_BODIES)]), turn[:, len(KEY_BODIES) :]

    def targets(self, ref: ReferenceFrame, action: Tensor) -> Tensor:
        """Servo targets (B, J) [rad] of actions (B, J)."""
        return middle_targets(ref, self.env.middle) + self.env.scale * action

    def references(self, clip: Tensor, frame: Tensor) -> list[ReferenceFrame]:
        """References of the coming control steps, one lookup for all: `horizon` + 1 times (B, ...)."""
        count = self.horizon + 1
        times = (frame + self._ahead[:, None]).flatten() * self.env.dt
        every = self.env.library.frames(clip.repeat(count), times)
        parts = {f.name: getattr(every, f.name).unflatten(0, (count, -1)).unbind() for f in fields(every)}
        return [ReferenceFrame(**dict(zip(parts, each, strict=True))) for each in zip(*parts.values(), strict=True)]

    def step(self, before: RobotState, after: Tensor, target: Tensor, actions: tuple, ref: ReferenceFrame) -> Step:
        """Inputs of a control step's reward, from its state after it (B, 13 + 2 J)."""
        state, feet = self.state(after)
        torque = self._kp * (target - state.joint_pos) + self._kd * state.joint_vel
        return Step(
            state=state,
            ref=ref if self.env.cfg.place == "world" else over_robot(ref, state.root_pos_w),
            torque=torque.clamp(-self._limit, self._limit),
            joint_acc=(state.joint_vel - before.joint_vel) / self.env.dt,
            actions=actions,
            foot_force_w=torch.zeros_like(feet[..., :3]),
            foot_quat_w=feet,
            limits=self.env.limits,
        )

    def rollout(self, act: Act, model: Dynamics, starts: Starts) -> Rollout:
        """Imagine `horizon` control steps; rewards and the last observation have gradients to the weights of `act`."""
        first = (starts.body, starts.before, starts.action, starts.earlier)
        body, before, last, earlier = (tensor.requires_grad_() for tensor in first)  # as later steps': compiled once
        sensors = self.env.groups["policy"].errors  # the memory holds true states, so any robot's errors fit them
        errors = None if sensors is None else sensors.under_way(len(body))
        *coming, final = self.references(starts.clip, starts.frame)
        keys, steps = self.state(body)[0].key_pos_w, []
        for ref, noise in zip(coming, self._noise(len(body)), strict=True):
            seen, after, keys, action, target, reward, lost = self._advanced(
                act, model, body, keys, before, last, earlier, starts.context, ref, noise, errors
            )
            steps.append((seen, reward, lost))
            if sensors is not None and errors is not None:
                errors = sensors.after(errors, (unpacked(body, keys), unpacked(after, keys)), self.env.dt)
            body, before, last, earlier = after, handed_on(target, before), action, last
        shown, rewards, losses = (torch.stack(each) for each in zip(*steps, strict=True))
        after = self._valued(see(self.terms, unpacked(body, keys), final, last), unpacked(body, keys), final, last)
        return Rollout.of(shown, after, rewards, losses, self._left(starts))

    def _valued(self, seen: Tensor, state: RobotState, ref: ReferenceFrame, last: Tensor) -> Tensor:
        """Observations of the value (B, V) where the policy sees `seen` (B, D)."""
        return torch.cat((seen, see(self.beside, state, ref, last)), dim=-1) if self.beside else seen

    def _advance(
        self,
        act: Act,
        model: Dynamics,
        body: Tensor,
        keys: Tensor,
        before: Tensor,
        last: Tensor,
        earlier: Tensor,
        context: Tensor,
        ref: ReferenceFrame,
        noise: Tensor | None,
        errors: Tensor | None,
    ) -> tuple[Tensor, ...]:
        """One imagined control step.

        Returns:
            What the value sees, the next state and its key bodies, action, servo targets, reward, and whose episode
            ends as a failure.
        """
        state = unpacked(body, keys)
        seen = see(self.terms, state, ref, last)
        sensors = self.env.groups["policy"].errors
        read = seen
        if sensors is not None and errors is not None:
            read = see(self.terms, sensors.read(state, errors), ref, last)
        action = act(read if noise is None else read + noise)
        target = self.targets(ref, action)
        after = model(body, target, before, context)
        step = self.step(state, after, target, (action, last, earlier), ref)
        reward = self.env.reward(step) / self.env.dt
        shown = self._valued(seen, state, ref, last).detach()
        return shown, after, step.state.key_pos_w, action, target, reward, self.lost(step)

    def _noise(self, robots: int) -> Sequence[Tensor | None]:
        """Errors of the sensors, (B, D) for each step, as the environment draws them."""
        levels = self.env.groups["policy"].levels
        if levels is None:
            return [None] * self.horizon
        return (levels * torch.empty(self.horizon, robots, len(levels), device=levels.device).uniform_(-1, 1)).unbind()

    def lost(self, step: Step) -> Tensor:
        """Robots (B,) bool whose episode ends as a failure with this step."""
        return fallen(step.state, step.ref) | (step.key_errors.amax(-1) > self.env.limit)

    def _left(self, starts: Starts) -> Tensor:
        """Control steps (B,) until the clip's end."""
        return self.env.library.length[starts.clip] - 1 - starts.frame
