"""Control steps of all worlds with the policy and its exploration, into the memory."""

from collections.abc import Callable

import torch
from tensordict import TensorDict
from torch import Tensor

from bumblebee.learning.world_model.body import packed
from bumblebee.learning.world_model.dynamics import handed_on
from bumblebee.learning.world_model.memory import Memory
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.observing.observations import middle_targets


class Collector:
    """Lets a policy act in `env`.

    Args:
        env: the worlds.
        memory: where their steps go.
        noise: standard deviation of the exploration, in units of the action; worlds have from none to twice as much.
    """

    def __init__(self, env: TrackingEnv, memory: Memory, noise: float) -> None:
        self._env, self._memory = env, memory
        self._noise = noise * torch.linspace(0, 2, env.num_envs, device=memory.broken.device)[:, None]
        self._last = torch.zeros(env.num_envs, env.num_actions, device=memory.broken.device)
        self._earlier = torch.zeros_like(self._last)
        self._past = memory.columns["before"].shape[-1] // env.num_actions
        self._before = self._held()

    @torch.no_grad()
    def __call__(self, act: Callable[[Tensor], Tensor]) -> TensorDict:
        """One control step; `act` maps observations (N, D) to actions (N, J). Gives back what was seen, in groups."""
        env = self._env
        seen = env.get_observations()
        action = act(seen["policy"])
        action = action + self._noise * torch.randn_like(action)
        state, ref = env.now
        target = middle_targets(ref, env.middle) + env.scale * action
        shown = {"before": self._before, "action": self._last, "earlier": self._earlier}
        self._memory.begin(env.clip, env.frame, body=packed(state), target=target, **shown)
        _, _, done, _ = env.step(action)
        self._memory.end(done | env.pushes.pushed)
        fresh = done[:, None]
        self._before = torch.where(fresh, self._held(), handed_on(target, self._before))
        self._earlier = self._last.masked_fill(fresh, 0.0)
        self._last = action.masked_fill(fresh, 0.0)
        return seen

    def state_dict(self) -> dict[str, Tensor]:
        """Actions and servo targets of the last steps, which the next rows of the memory tell of."""
        return {"last": self._last.cpu(), "earlier": self._earlier.cpu(), "before": self._before.cpu()}

    def load_state_dict(self, saved: dict[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        device = self._last.device
        self._last, self._earlier, self._before = (saved[name].to(device) for name in ("last", "earlier", "before"))

    def _held(self) -> Tensor:
        """Targets (N, P J) [rad] that a robot's servos are held at when its episode begins in this frame."""
        ref = self._env.library.frames(self._env.clip, self._env.frame * self._env.dt)
        return ref.hold_pos.repeat(1, self._past)
