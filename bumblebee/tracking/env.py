"""The environment of PPO: robots that follow clips, as an rsl_rl `VecEnv`.

The action moves the servo targets around the reference one control step ahead, or around a stand; observations are
groups "policy" (with the sensors' noise), "critic" (exact, with forces and the time left in the clip) and, where the
policy has a student, "student".
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict
from torch import Tensor

from bumblebee.sim.cuda_graph import Captured
from bumblebee.sim.engine import Engine, RobotState
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.in_place import renewed
from bumblebee.tracking.observing.groups import Group
from bumblebee.tracking.observing.observations import action_middle, action_scale, middle_targets
from bumblebee.tracking.observing.sensor_errors import SensorErrors
from bumblebee.tracking.observing.terms import expanded, see
from bumblebee.tracking.rewards import Limits, Reward, Step
from bumblebee.tracking.rows import Rows
from bumblebee.tracking.sampling.library import MotionLibrary, ReferenceFrame, over_robot
from bumblebee.tracking.sampling.sampler import ClipShares
from bumblebee.tracking.sampling.starts import start_state
from bumblebee.tracking.sampling.stretches import StretchSampler, sampler_of
from bumblebee.tracking.statistics import Statistics
from bumblebee.tracking.terminations import fallen, threshold_at
from bumblebee.tracking.threads import Aside, one_thread
from bumblebee.tracking.worlds.pushes import Pushes
from bumblebee.tracking.worlds.randomisation import randomise_worlds
from bumblebee.tracking.worlds.terrain import Ground

ActionAdapter = Callable[[RobotState, Tensor, Tensor], Tensor]
"""(state, joint targets (B, J) [rad] of an action of zero, action (B, J)) -> what the motors execute, (B, J)."""


class TrackingEnv(VecEnv):
    """Follow the clips of `library` with `engine`'s robots.

    What a step leaves for the next lies in tensors that stay where they are and are written in place, so that on a GPU
    the work around the physics is recorded once and replayed without the host. On a CPU state, reference and what is
    seen are new tensors each step, which saves copies.

    Args:
        library: the reference motions, on the engine's device.
        engine: the robots; its worlds are randomised here.
        config: the task.
        seed: of every draw in here.
        action_adapter: what happens to an action before it reaches the motors (a learned delta), if anything.
        clip_share: shares of the draws of groups of clips, if they are to hold whatever fails.
    """

    def __init__(
        self,
        library: MotionLibrary,
        engine: Engine,
        config: EnvConfig,
        seed: int = 0,
        action_adapter: ActionAdapter | None = None,
        clip_share: ClipShares | None = None,
    ) -> None:
        self.library, self.engine, self.action_adapter, self.seed = library, engine, action_adapter, seed
        self.cfg, device = config, engine.device
        self.num_envs, self.num_actions, self.device = engine.num_worlds, library.num_joints, str(device)
        self.dt = engine.control_dt
        self.max_episode_length = round(config.episode_seconds / self.dt)
        self.scale, middle = action_scale().to(device), action_middle(config.action)
        self.middle = None if middle is None else middle.to(device)
        self.reward = Reward(config.reward, self.dt, device)
        own, compiled = self.reward, config.compile
        self._earned: Callable[[Step], Tensor] = torch.compile(own.__call__, dynamic=False) if compiled else own
        self.limits = Limits.of_robot(config.reward.soft_limit, device)
        drawing = (config.sampler_floor, config.sampler_memory, config.start_share, clip_share)
        self.sampler = sampler_of(library.length, round(config.sampler_stretch / self.dt), *drawing)
        self.statistics, self._generator = Statistics(device), torch.Generator(device).manual_seed(seed)
        randomise_worlds(engine, config.randomisation, seed)
        self._threshold = torch.zeros((), device=device)
        self.progress = 0.0
        n, j = self.num_envs, self.num_actions
        self.ground = Ground(config.terrain, n, device) if config.terrain.rough else None
        wanted = {"policy": config.observation} | ({"student": config.student} if config.student.terms else {})
        sizes, noise = (n, j, len(library.ahead)), config.observation_noise
        self.errors = SensorErrors(config.sensors, n, device) if config.sensors.any else None
        last = (noise, device, config.compile, self.errors)
        self.groups = {name: Group(own, sizes, *last) for name, own in wanted.items()}
        self._critic = expanded(config.critic)
        self.episode_length_buf = torch.zeros(n, dtype=torch.long, device=device)
        self._clip, self._frame = torch.zeros_like(self.episode_length_buf), torch.zeros_like(self.episode_length_buf)
        self._command = torch.zeros(n, j, device=device)
        self._action, self._action_before = torch.zeros_like(self._command), torch.zeros_like(self._command)
        self._rewards = torch.zeros(n, device=device)
        self._dones = torch.zeros(n, dtype=torch.bool, device=device)
        self._time_outs = torch.zeros_like(self._dones)
        self.pushes = Pushes(config.randomisation, n, self.dt, device)
        self._restart(torch.ones_like(self._dones))
        engine.settle()
        self._state, self._ref = self._read(), self._coming()
        self._privileged = self._extended(self.groups["policy"].exact)
        self._recorded = device.type == "cuda"
        self._aside = Aside(1 if self._recorded else config.threads)
        self._judge_recorded = Captured(self._judge, device, [self._generator])
        self._look_recorded = Captured(self._look, device, [self._generator])
        self._look()

    @property
    def progress(self) -> float:
        """Share of the training that is done, 0 to 1: the curriculum follows it."""
        return self._progress

    @progress.setter
    def progress(self, value: float) -> None:
        self._progress = value
        self._threshold.fill_(self.threshold)
        self.reward.progress(value)

    @property
    def threshold(self) -> float:
        """Distance of a key body that ends an episode now [m]."""
        c = self.cfg
        return threshold_at(self.progress, c.threshold_start, c.threshold_end, c.threshold_share)

    @property
    def clip(self) -> Tensor:
        """Index of the clip that each world follows now, (B,)."""
        return self._clip

    @property
    def frame(self) -> Tensor:
        """Frame of its clip at which each world is now, (B,)."""
        return self._frame

    @property
    def now(self) -> tuple[RobotState, ReferenceFrame]:
        """The robots now, and the reference at the end of the coming control step; the next step writes over them."""
        return self._state, self._ref

    @property
    def limit(self) -> Tensor:
        """`threshold` [m] as a tensor () that stays where it is."""
        return self._threshold

    def get_observations(self) -> TensorDict:
        """Groups "policy" (B, D), "critic" (B, D + extras), perhaps "student"; the tensors are the caller's to keep."""
        shown = {name: group.noisy for name, group in self.groups.items()} | {"critic": self._privileged}
        if self._recorded:  # the next look writes into these tensors
            shown = {name: tensor.clone() for name, tensor in shown.items()}
        return TensorDict(shown, batch_size=[self.num_envs])

    def step(self, actions: Tensor) -> tuple[TensorDict, Tensor, Tensor, dict[str, Any]]:
        """One control period: observations, rewards (B,), dones (B,) and `extras["time_outs"]` (B,)."""
        with one_thread():
            middle, adapter = middle_targets(self._ref, self.middle), self.action_adapter
            motor = actions if adapter is None else adapter(self._state, middle, actions)
            self._command.copy_(actions)
            self.engine.step(middle + self.scale * motor)
            self._judge_recorded()
            self.engine.settle()
            self._look_recorded()
        outcome = self._rewards.clone(), self._dones.clone(), {"time_outs": self._time_outs.float()}
        return self.get_observations(), *outcome

    def state_dict(self) -> dict[str, Any]:
        """Everything that training needs to go on from here exactly."""
        return {
            "engine": self.engine.state_dict(),
            **{name: tensor.clone() for name, tensor in (self._kept() | self._shown()).items()},
            "progress": self.progress,
            "generator": self._generator.get_state(),
        }

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self.engine.load_state_dict(saved["engine"])
        self.progress = saved["progress"]
        for name, tensor in self._kept().items():
            tensor.copy_(saved[name])
        for name, own in self.groups.items():
            own.show(saved[f"{name}_exact"], saved[f"{name}_noisy"])
        self._privileged = renewed(self._privileged, saved["privileged"], self._recorded)
        self._move_on()
        self._generator.set_state(saved["generator"].cpu())

    def _kept(self) -> dict[str, Tensor]:
        """Tensors that a step leaves for the next, beside state and reference, which follow from it."""
        kept = {name: getattr(self, f"_{name}") for name in ("clip", "frame", "action", "action_before")}
        kept["push_clock"] = self.pushes.clock
        for group, own in self.groups.items():
            kept |= {f"{group}_{name}": tensor for name, tensor in own.kept().items()}
        if self.ground is not None:
            kept["origin"] = self.ground.origin
        if self.errors is not None:
            kept["sensor_errors"] = self.errors.now
        return kept | {"episode_length": self.episode_length_buf, "failure": self.sampler.failure}

    def _shown(self) -> dict[str, Tensor]:
        """Observations that were seen last."""
        shown = {"privileged": self._privileged}
        for name, own in self.groups.items():
            shown |= {f"{name}_exact": own.exact, f"{name}_noisy": own.noisy}
        return shown

    def _read(self) -> RobotState:
        """The robots now, each in its clip's frame."""
        state = self.engine.state()
        return state if self.ground is None else self.ground.in_clip_frame(state)

    def _judge(self) -> None:
        """Judge the step: its reward, who has failed or come to an end, and new starts for these."""
        state = self._read()
        self._frame += 1
        self.episode_length_buf += 1
        outcome = Step(
            state=state,
            ref=self._ref if self.cfg.place == "world" else over_robot(self._ref, state.root_pos_w),
            torque=self.engine.torque(),
            joint_acc=(state.joint_vel - self._state.joint_vel) / self.dt,
            actions=(self._command, self._action, self._action_before),
            foot_force_w=self.engine.foot_force_w(),
            foot_quat_w=self.engine.foot_quat_w(),
            limits=self.limits,
        )
        unstable = self.engine.unstable()
        # A world that blew up holds no meaningful numbers: it neither earns nor is averaged.
        self._rewards.copy_(self._earned(outcome).masked_fill(unstable, 0.0))
        lost = self._fallen(outcome) | (outcome.key_errors.amax(-1) > self._threshold) | unstable
        ended = self._frame >= self.library.length[self._clip] - 1
        if self.ground is not None:
            ended |= self.ground.beyond(state)
        self._time_outs.copy_((ended | (self.episode_length_buf >= self.max_episode_length)) & ~lost)
        self._dones.copy_(lost | self._time_outs)
        self._action_before.copy_(self._action)
        self._action.copy_(self._command)
        self.statistics.add(outcome, self._rewards, self._dones, lost, unstable, self.episode_length_buf)
        if isinstance(self.sampler, StretchSampler):
            self.sampler.follow(self._clip, self._frame, lost, self._dones)
        else:
            over = Rows(self._dones, self.engine.by_mask)
            self.sampler.update(over.of(self._clip), over.of(lost), over.of(self._dones))
        if self.errors is not None and self.errors.drifts:
            self.errors.now.copy_(self.errors.after(self.errors.now, (self._state, state), self.dt, self._generator))
        self._restart(self._dones)
        self.pushes.apply(self.engine, self._generator)

    def _fallen(self, step: Step) -> Tensor:
        """Robots (B,) bool that a step leaves lying."""
        return fallen(step.state, step.ref)

    def _restart(self, over: Tensor) -> None:
        """Put the robots `over` (B,) bool at new starts."""
        rows, g = Rows(over, self.engine.by_mask), self._generator
        if len(rows) == 0:
            return
        clip, frame = self.sampler.draw(len(rows), g)
        ref = self.library.frames(clip, frame * self.dt)
        qpos, qvel = start_state(ref, self.cfg.reset_noise, g)
        if self.ground is not None:
            qpos = self.ground.place(rows, qpos, g)
        self.engine.reset(rows.chosen, qpos, qvel, ref.hold_pos)
        if self.errors is not None:
            self.errors.renew(rows, g)
        rows.put(self._clip, clip)
        rows.put(self._frame, frame)
        for tensor in (self._action, self._action_before, self.episode_length_buf):
            rows.put(tensor, 0)

    def _look(self) -> None:
        """The state, the reference of the coming step, and the observations of both; noise is drawn meanwhile."""
        draws = [self._aside(partial(group.draws, self._generator)) for group in self.groups.values()]
        self._move_on()
        fresh = Rows(self.episode_length_buf == 0, self.engine.by_mask)
        for group, begun in zip(self.groups.values(), draws, strict=True):
            group.look(self._state, self._ref, self._action, fresh, self._generator, begun)
        self._privileged = renewed(self._privileged, self._extended(self.groups["policy"].exact), self._recorded)

    def _move_on(self) -> None:
        """Take the state and the reference of the coming step."""
        self._state = renewed(self._state, self._read(), self._recorded)
        self._ref = renewed(self._ref, self._coming(), self._recorded)

    def _coming(self) -> ReferenceFrame:
        """The reference at the end of the coming control period."""
        return self.library.frames(self._clip, (self._frame + 1) * self.dt)

    def _extended(self, exact: Tensor) -> Tensor:
        """Observation of the critic (B, D + extras), from the exact observation (B, D)."""
        left = (self.library.length[self._clip] - self._frame).float() * self.dt
        fresh = (self.episode_length_buf == 0)[:, None]  # its sensors still tell of the episode before
        extras = (
            (self.engine.foot_force_w().flatten(1) / 300.0).masked_fill(fresh, 0.0),
            (self.engine.torque() / self.limits.torque).masked_fill(fresh, 0.0),
            left[:, None].clamp(max=2.0),
            self._threshold.expand(self.num_envs, 1),
        )
        beside = [see(self._critic, self._state, self._ref, self._action)] if self._critic else []
        return torch.cat((exact, *beside, *extras), dim=-1)
