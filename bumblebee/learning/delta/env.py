"""The delta policy's task: replay recorded targets in the simulator and keep it on the recording (paper, 3.3.2).

Every episode starts from a recorded state and holds the recorded targets plus the policy's correction for
`episode_seconds`; nothing is randomised. Rewards are the paper's table, times the control period.
"""

from typing import Any

import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.learning.delta import rewards
from bumblebee.learning.delta.action import DeltaConfig, correction, observe, placement
from bumblebee.learning.delta.recordings import Recordings
from bumblebee.robot.facts import joints
from bumblebee.sim.engine import Engine, RobotState
from bumblebee.sim.rotations import rotate_inverse

_SLACK = 0.02
"""How far a joint of the simulator goes beyond a limit that it only leans on [rad]."""


class DeltaEnv(VecEnv):
    """rsl_rl's environment interface over an engine and recordings.

    Args:
        engine: the corrected simulator.
        recordings: training rollouts only.
        config: see `DeltaConfig`.
        encoder_offset: (J,) [rad] what the encoders add, taken off a recording before it becomes a state.

    Raises:
        BadInput: if no recording is as long as an episode.
    """

    def __init__(self, engine: Engine, recordings: Recordings, config: DeltaConfig, encoder_offset: Tensor) -> None:
        device = engine.device
        self.engine, self.recordings, self.config = engine, recordings.to(device), config
        self.num_envs, self.num_actions, self.device = engine.num_worlds, len(config.joints), str(device)
        self.max_episode_length = round(config.episode_seconds / engine.control_dt)
        self.cfg = config
        self._offset = encoder_offset.to(device)
        self._starts = self.recordings.windows(self.max_episode_length, stride=1)
        if not len(self._starts):
            came = f"{len(recordings.ids)} of at most {float(recordings.length.max()) * engine.control_dt:.1f} s"
            do = "Record longer, or shorten delta.episode_seconds."
            raise BadInput("delta: recordings", f"one of more than {config.episode_seconds:g} s", came, do)
        self._placement = placement(config.joints).to(device)
        facts = joints()
        self._effort = torch.tensor([j.effort_limit for j in facts], device=device)
        self._low, self._high = torch.tensor([j.range for j in facts], device=device).T
        self._speed = torch.tensor([j.velocity_limit for j in facts], device=device)
        self._generator = torch.Generator(device).manual_seed(config.seed)
        self.episode_length_buf = torch.zeros(self.num_envs, dtype=torch.long, device=device)
        self._row = torch.zeros(self.num_envs, dtype=torch.long, device=device)
        self._last = torch.zeros(self.num_envs, self.num_actions, device=device)
        self._joint_vel = torch.zeros(self.num_envs, len(facts), device=device)
        self._restart(torch.arange(self.num_envs, device=device))

    def get_observations(self) -> TensorDict:
        """Observations of the policy and the critic now."""
        seen = observe(self.engine.state(), self.recordings.targets[self._row])
        return TensorDict({"policy": seen, "critic": seen.clone()}, batch_size=[self.num_envs])

    def step(self, actions: Tensor) -> tuple[TensorDict, Tensor, Tensor, dict[str, Any]]:
        """One control period; `actions` (B, 4) are raw corrections [rad]."""
        delta = correction(actions, self.config.limit)
        self.engine.step(self.recordings.targets[self._row] + delta @ self._placement)
        self._row = self._row + 1
        self.episode_length_buf = self.episode_length_buf + 1
        state, unstable = self.engine.state(), self.engine.unstable()
        distance = (state.root_pos_w - self.recordings.qpos[self._row, :3]).norm(dim=-1)
        lost = (distance > self.config.divergence) | unstable
        reward = torch.where(unstable, 0.0, self._reward(state, delta)).nan_to_num()
        reward = reward + self.config.rewards.termination * lost * self.engine.control_dt
        timeout = self.episode_length_buf >= self.max_episode_length
        done = lost | timeout
        extras = {"time_outs": timeout & ~lost, "log": {"lost": float(lost.float().mean())}}
        self._last, self._joint_vel = delta, state.joint_vel
        self._restart(done.nonzero()[:, 0])
        return self.get_observations(), reward, done.long(), extras

    def _reward(self, state: RobotState, delta: Tensor) -> Tensor:
        weight, qpos, qvel = self.config.rewards, self.recordings.qpos[self._row], self.recordings.qvel[self._row]
        torque = self.engine.torque()
        acceleration = (state.joint_vel - self._joint_vel) / self.engine.control_dt
        velocity_b = rotate_inverse(qpos[:, 3:7], qvel[:, :3])
        small = self.config.action_penalty
        total = (
            weight.torque_limits * rewards.beyond(torque, -0.999 * self._effort, 0.999 * self._effort)
            + weight.dof_pos_limits * rewards.beyond_alone(state.joint_pos, qpos[:, 7:], self._low, self._high, _SLACK)
            + weight.dof_vel_limits * rewards.beyond_alone(state.joint_vel, qvel[:, 6:], -self._speed, self._speed)
            + weight.dof_acc * rewards.squared_norm(acceleration)
            + weight.action_rate * small * rewards.squared_norm(delta - self._last)
            + weight.action_norm * small * rewards.norm(delta)
            + weight.torque * rewards.norm(torque)
            + weight.root_pos * rewards.closeness(state.root_pos_w, qpos[:, :3])
            + weight.root_rot * rewards.rotation_closeness(state.root_quat_w, qpos[:, 3:7])
            + weight.root_ang_vel * rewards.closeness(state.root_ang_vel_b, qvel[:, 3:6])
            + weight.root_vel * rewards.closeness(state.root_lin_vel_b, velocity_b)
            + weight.dof_pos * rewards.closeness(state.joint_pos, qpos[:, 7:])
            + weight.dof_vel * rewards.closeness(state.joint_vel, qvel[:, 6:])
        )
        return total * self.engine.control_dt

    def _restart(self, ids: Tensor) -> None:
        if len(ids) == 0:
            return
        drawn = torch.randint(len(self._starts), (len(ids),), generator=self._generator, device=ids.device)
        rows = self._starts[drawn]
        restart(self.engine, self.recordings, ids, rows, self._offset)
        self._row[ids] = rows
        self.episode_length_buf[ids] = 0
        self._last[ids] = 0.0
        self._joint_vel[ids] = self.recordings.qvel[rows, 6:]


def restart(engine: Engine, recordings: Recordings, ids: Tensor, rows: Tensor, encoder_offset: Tensor) -> None:
    """Put the robots `ids` where the recording was at `rows`, as if the target before had long been held."""
    qpos = recordings.qpos[rows].clone()
    qpos[:, 7:] -= encoder_offset
    first = recordings.start[recordings.owner(rows)]
    before = torch.maximum(rows - 1, first)
    engine.reset(ids, qpos, recordings.qvel[rows], recordings.targets[before])
