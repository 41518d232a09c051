"""The environment of PPO: robots that follow clips, as an rsl_rl `VecEnv`.

The action moves the servo targets around the reference one control step ahead; observations are groups "policy" (noisy,
computable on the robot) and "critic" (exact, with forces and the time left in the clip).
"""

from collections.abc import Callable
from typing import Any

import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict
from torch import Tensor

from bumblebee.robot.facts import joints
from bumblebee.robot.model import gains
from bumblebee.sim.engine import RobotState
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.rotations import from_rotation_vector, multiply
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.library import MotionLibrary, ReferenceFrame
from bumblebee.tracking.noise import noise_levels
from bumblebee.tracking.observations import joint_targets, layout, observe
from bumblebee.tracking.randomisation import draw_push, randomise_worlds
from bumblebee.tracking.rewards import Limits, Reward, Step
from bumblebee.tracking.sampler import ClipSampler
from bumblebee.tracking.statistics import Statistics
from bumblebee.tracking.terminations import fallen, key_distance, threshold_at

ActionAdapter = Callable[[RobotState, Tensor, Tensor], Tensor]
"""(state, exact observation (B, D), action (B, J)) -> the action that the motors execute, (B, J)."""


def action_scale() -> Tensor:
    """Scale of the action (J,) [rad]: a quarter of the angle at which the servo reaches its torque limit, bounded."""
    scale = [0.25 * joint.effort_limit / gains(joint)[0] for joint in joints()]
    return torch.tensor(scale, dtype=torch.float32).clamp(0.08, 0.35)


class TrackingEnv(VecEnv):
    """Follow the clips of `library` with `engine`'s robots.

    Args:
        library: the reference motions.
        engine: the robots; its worlds are randomised here.
        config: the task.
        seed: of every draw in here.
        action_adapter: what happens to an action before it reaches the motors (a learned delta), if anything.
        clip_share: (N,) optional factor on how often each clip is drawn.
    """

    def __init__(
        self,
        library: MotionLibrary,
        engine: MujocoCpu,
        config: EnvConfig,
        seed: int = 0,
        action_adapter: ActionAdapter | None = None,
        clip_share: Tensor | None = None,
    ) -> None:
        self.library, self.engine, self.action_adapter = library, engine, action_adapter
        self.cfg = config
        self.num_envs, self.num_actions, self.device = engine.num_worlds, library.num_joints, "cpu"
        self.dt = engine.control_dt
        self.max_episode_length = round(config.episode_seconds / self.dt)
        self.episode_length_buf = torch.zeros(self.num_envs, dtype=torch.long)
        self.scale = action_scale()
        self.reward = Reward(config.reward, self.dt)
        self.limits = Limits.of_robot(config.reward.soft_limit)
        self.sampler = ClipSampler(
            library.length, config.sampler_floor, config.sampler_memory, config.start_share, clip_share
        )
        self.statistics = Statistics()
        self.progress = 0.0
        self._noise = config.observation_noise * noise_levels(layout(self.num_actions, len(library.ahead)))
        self._generator = torch.Generator().manual_seed(seed)
        randomise_worlds(engine, config.randomisation, seed)
        n, j = self.num_envs, self.num_actions
        self._clip = torch.zeros(n, dtype=torch.long)
        self._frame = torch.zeros(n, dtype=torch.long)
        self._action, self._action_before = torch.zeros(n, j), torch.zeros(n, j)
        self._restart(torch.arange(n))
        self._look()

    @property
    def threshold(self) -> float:
        """Distance of a key body that ends an episode now [m]."""
        c = self.cfg
        return threshold_at(self.progress, c.threshold_start, c.threshold_end, c.threshold_share)

    @property
    def clip(self) -> Tensor:
        """Index of the clip that each world follows now, (B,)."""
        return self._clip

    def get_observations(self) -> TensorDict:
        """Groups "policy" (B, D) and "critic" (B, D + extras)."""
        return self._observations

    def step(self, actions: Tensor) -> tuple[TensorDict, Tensor, Tensor, dict[str, Any]]:
        """One control period: observations, rewards (B,), dones (B,) and `extras["time_outs"]` (B,)."""
        motor = actions if self.action_adapter is None else self.action_adapter(self._state, self._exact, actions)
        speed_before = self._state.joint_vel
        self.engine.step(joint_targets(self._ref, motor, self.scale))
        self._frame += 1
        self.episode_length_buf += 1
        state = self.engine.state()
        outcome = Step(
            state=state,
            ref=self._ref,
            torque=self.engine.torque(),
            joint_acc=(state.joint_vel - speed_before) / self.dt,
            actions=(actions, self._action, self._action_before),
            foot_force_w=self.engine.foot_force_w(),
            foot_quat_w=self.engine.foot_quat_w(),
            limits=self.limits,
        )
        rewards = self.reward(outcome)
        distance = key_distance(state, self._ref)
        unstable = self.engine.unstable()
        lost = fallen(state, self._ref) | (distance > self.threshold) | unstable
        # A world that blew up holds no meaningful numbers: it neither earns nor is averaged.
        rewards = torch.where(unstable, torch.zeros_like(rewards), rewards)
        ended = self._frame >= self.library.length[self._clip] - 1
        time_outs = (ended | (self.episode_length_buf >= self.max_episode_length)) & ~lost
        dones = lost | time_outs
        self._action_before, self._action = self._action, actions.clone()
        self.statistics.add(outcome, rewards, dones, lost, unstable, self.episode_length_buf)
        self._begin_next(dones, lost)
        return self._observations, rewards, dones, {"time_outs": time_outs.float()}

    def state_dict(self) -> dict[str, Any]:
        """Everything that training needs to go on from here exactly."""
        return {
            "engine": self.engine.state_dict(),
            "clip": self._clip.clone(),
            "frame": self._frame.clone(),
            "actions": (self._action.clone(), self._action_before.clone()),
            "episode_length": self.episode_length_buf.clone(),
            "failure": self.sampler.failure.clone(),
            "progress": self.progress,
            "generator": self._generator.get_state(),
            "observations": self._observations.to_dict(),
        }

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self.engine.load_state_dict(saved["engine"])
        self._clip, self._frame = saved["clip"], saved["frame"]
        self._action, self._action_before = saved["actions"]
        self.episode_length_buf = saved["episode_length"]
        self.sampler.failure = saved["failure"]
        self.progress = saved["progress"]
        self._look()
        self._generator.set_state(saved["generator"])
        self._observations = TensorDict(saved["observations"], batch_size=[self.num_envs])

    def _begin_next(self, dones: Tensor, lost: Tensor) -> None:
        """Restart what has ended, push, and look again."""
        over = dones.nonzero()[:, 0]
        self.sampler.update(self._clip[over], lost[over])
        self._restart(over)
        push = draw_push(self.cfg.randomisation, self.num_envs, self.dt, self._generator)
        if push is not None:
            self.engine.push(push)
        self._look()

    def _restart(self, ids: Tensor) -> None:
        n, g = len(ids), self._generator
        if n == 0:
            return
        self._clip[ids], self._frame[ids] = self.sampler.draw(n, g)
        ref = self.library.frames(self._clip[ids], self._frame[ids] * self.dt)
        qpos, qvel = start_state(ref, self.cfg.reset_noise, g)
        self.engine.reset(ids, qpos, qvel, ref.hold_pos)
        self._action[ids] = 0.0
        self._action_before[ids] = 0.0
        self.episode_length_buf[ids] = 0

    def _look(self) -> None:
        """The state, the reference of the coming step, and the observations of both."""
        self._state = self.engine.state()
        self._ref = self.library.frames(self._clip, (self._frame + 1) * self.dt)
        self._exact = observe(self._state, self._ref, self._action)
        noise = self._noise * (2 * torch.rand(self._exact.shape, generator=self._generator) - 1)
        left = (self.library.length[self._clip] - self._frame).float() * self.dt
        extras = (
            self.engine.foot_force_w().flatten(1) / 300.0,
            self.engine.torque() / self.limits.torque,
            left[:, None].clamp(max=2.0),
            torch.full((self.num_envs, 1), self.threshold),
        )
        groups = {"policy": self._exact + noise, "critic": torch.cat((self._exact, *extras), dim=-1)}
        self._observations = TensorDict(groups, batch_size=[self.num_envs])


def start_state(ref: ReferenceFrame, noise: float, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Start qpos (n, 7 + J) and qvel (n, 6 + J) at the reference, with uniform noise times `noise`."""
    n, j = ref.joint_pos.shape

    def uniform(columns: int, size: float) -> Tensor:
        return noise * size * (2 * torch.rand(n, columns, generator=generator) - 1)

    shift = uniform(3, 0.02)
    shift[:, 2] = 0.0  # never into the floor
    quat = multiply(ref.root_quat_w, from_rotation_vector(uniform(3, 0.04)))
    qpos = torch.cat((ref.root_pos_w + shift, quat, ref.joint_pos + uniform(j, 0.03)), dim=-1)
    speeds = (ref.root_lin_vel_w + uniform(3, 0.1), ref.root_ang_vel_b + uniform(3, 0.2))
    return qpos, torch.cat((*speeds, ref.joint_vel + uniform(j, 0.3)), dim=-1)
