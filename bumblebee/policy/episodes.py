"""Runs policies on robots, one clip each, and records what the sensors said: the measured rollouts."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import torch

from bumblebee import quaternions
from bumblebee.compensation.numbers import Compensation
from bumblebee.evaluation.contract import StartNoise
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip, velocities
from bumblebee.motion.kinematics import sole_points
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.odometry import placed
from bumblebee.policy.robots import CONTROL_HZ, Robots
from bumblebee.policy.runner import PolicyRunner, reference_key, reference_library
from bumblebee.robot.facts import ROBOT, joint_names
from bumblebee.robot.facts import joints as robot_joints
from bumblebee.robot.model import gains
from bumblebee.robot.sensors import SensorNoise, Sensors, add_noise, draws
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.terminations import FALL, Stop, beyond

MAX_LIFT = 0.10  # m: a start is lifted or lowered by no more than this to stand on the floor


FALL_RULE = {"tilt_deg": FALL.tilt_deg, "drop_m": FALL.drop_m, "max_start_lift_m": MAX_LIFT}


@dataclass(frozen=True)
class Episode:
    """One policy on one clip from one seed."""

    rollout_id: str
    """Name of the rollout; unique in a run."""
    policy: str
    """Key of the policy among those given to `run_episodes`."""
    motion: str
    """Name of the clip."""
    seed: int
    """Seed of the start state and the sensor noise; one seed and motion give equal draws whatever runs beside."""
    meta: dict[str, Any] = field(default_factory=dict)
    """Further fields of the rollout's metadata (cluster, operator, ...)."""


def run_episodes(
    make_robots: Callable[[int], Robots],
    episodes: Sequence[Episode],
    policies: dict[str, ExportedPolicy],
    clips: dict[str, Clip],
    noise: SensorNoise,
    start: StartNoise | None = None,
    on_tick: Callable[[int], None] = lambda ended: None,
    compensations: Mapping[str, Compensation] | None = None,
    stop: Stop = FALL,
    judged: bool = False,
) -> list[Rollout]:
    """Run all episodes side by side and return their rollouts in order; a robot that falls stops there.

    Args:
        make_robots: robots for a number of episodes.
        episodes: what to run.
        policies: by the episodes' keys.
        clips: by name, 50 frames a second.
        noise: on what the policy and the log get.
        start: noise of the start state.
        on_tick: told after each control tick how many robot ticks were simulated in it.
        compensations: by the episodes' keys of policies; one policy with and without has two keys.
        stop: when a robot counts as fallen.
        judged: whether the rollouts hold the true state, as motion capture sees it, in place of the readings that the
            policy acted on: an encoder that is off would else be judged by its own reading.
    """
    compensations = compensations or {}
    robots = make_robots(len(episodes))
    own = [clips[episode.motion] for episode in episodes]
    lengths = np.array([clip.frames for clip in own])
    rngs = [episode_generator(episode) for episode in episodes]
    qpos, qvel = start_states(own, rngs, start or StartNoise())
    groups = _groups(episodes, policies, own, compensations)
    held = np.zeros_like(qpos[:, 7:])
    for ids, runner in groups:
        held[ids] = runner.hold()
    robots.reset(qpos, qvel, held)
    normal = [rng.standard_normal((clip.frames, draws(qpos.shape[1] - 7))) for rng, clip in zip(rngs, own, strict=True)]
    place = placed(noise, qpos[:, :3], rngs, 1.0 / CONTROL_HZ)
    log, ended = _Log(len(episodes)), np.zeros(len(episodes), dtype=bool)
    for tick in range(int(lengths.max())):
        alive = np.flatnonzero(~ended & (tick < lengths))
        true = robots.read()
        fallen = alive[_fallen(true, [own[i] for i in alive], alive, tick, stop)] if tick and len(alive) else alive[:0]
        ended[fallen] = True
        alive = np.setdiff1d(alive, fallen)
        if not len(alive):
            break
        sensors = place(alive, add_noise(true[alive], noise, np.stack([normal[i][tick] for i in alive])))
        action, command = _act(groups, alive, tick, sensors)
        log.add(alive, robots.truth()[alive] if judged else sensors, action, command.target)
        robots.step(alive, command)
        on_tick(len(alive))
    return [
        log.rollout(i, e, policies[e.policy], clips[e.motion], compensations.get(e.policy))
        for i, e in enumerate(episodes)
    ]


def start_states(
    clips: Sequence[Clip], rngs: Sequence[np.random.Generator], noise: StartNoise
) -> tuple[np.ndarray, np.ndarray]:
    """Start states at the clips' first frames, joints with noise, soles on the floor.

    Returns qpos (B, 7 + J) and qvel (B, 6 + J). A clip whose first frame is further than 10 cm
    from the floor (it starts in the air) is left where it is.
    """
    first = [velocities(clip) for clip in clips]
    joints = np.stack([clip.joint_pos[0] for clip in clips]).astype(np.float64)
    speed = np.stack([v.joint_vel[0] for v in first]).astype(np.float64)
    joints += noise.joint_pos * np.stack([rng.standard_normal(joints.shape[1]) for rng in rngs])
    speed += noise.joint_vel * np.stack([rng.standard_normal(joints.shape[1]) for rng in rngs])
    ranges = np.array([joint.range for joint in robot_joints()])
    joints = np.clip(joints, ranges[:, 0], ranges[:, 1])
    place = np.stack([clip.root_pos[0] for clip in clips]).astype(np.float64)
    quat = quaternions.normalised(np.stack([clip.root_quat[0] for clip in clips]).astype(np.float64))
    height = sole_points(place, quat, joints)[..., 2].min(axis=(1, 2))
    place[:, 2] -= np.where(np.abs(height) <= MAX_LIFT, height, 0.0)
    root = [np.stack([getattr(v, name)[0] for v in first]) for name in ("root_lin_vel_w", "root_ang_vel_b")]
    return np.concatenate([place, quat, joints], axis=1), np.concatenate([*root, speed], axis=1)


class _Log:
    """Rows of all robots, tick by tick."""

    def __init__(self, count: int) -> None:
        self._rows: list[list[dict[str, np.ndarray]]] = [[] for _ in range(count)]

    def add(self, robots: np.ndarray, sensors: Sensors, action: np.ndarray, target: np.ndarray) -> None:
        columns = {f.name: getattr(sensors, f.name) for f in fields(sensors)} | {
            "action": action,
            "joint_target": target,
        }
        for row, robot in enumerate(robots):
            self._rows[robot].append({name: values[row] for name, values in columns.items()})

    def rollout(
        self, robot: int, episode: Episode, policy: ExportedPolicy, clip: Clip, undone: Compensation | None
    ) -> Rollout:
        rows = self._rows[robot]
        stacked = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
        servo = [gains(joint) for joint in robot_joints()]
        meta = {
            "robot": ROBOT,
            "kp": [kp for kp, _ in servo] if undone is None else undone.kp.tolist(),
            "kd": [kd for _, kd in servo] if undone is None else undone.kd.tolist(),
            "motion": clip.name,
            "policy": {"name": episode.policy, "version": "", "sha256": policy.sha256},
            **episode.meta,
            **({} if undone is None else {"compensation": undone.sha256}),
        }
        time = np.arange(len(rows)) / CONTROL_HZ
        return Rollout(episode.rollout_id, joint_names(), CONTROL_HZ, time, meta=meta, **stacked)


def _groups(
    episodes: Sequence[Episode],
    policies: dict[str, ExportedPolicy],
    clips: list[Clip],
    compensations: Mapping[str, Compensation],
) -> list[tuple[np.ndarray, PolicyRunner]]:
    """Episodes by policy: their indices and a runner over them."""
    members: dict[str, list[int]] = {}
    for index, episode in enumerate(episodes):
        members.setdefault(episode.policy, []).append(index)
    distinct = list({clip.name: clip for clip in clips}.values())
    shared: dict[object, MotionLibrary] = {}
    groups = []
    for key, ids in members.items():
        policy = policies[key]
        wanted = reference_key(policy)
        if wanted not in shared:
            shared[wanted] = reference_library(policy, distinct)
        names = [clips[i].name for i in ids]
        groups.append((np.array(ids), PolicyRunner(policy, shared[wanted], names, compensations.get(key))))
    return groups


def _act(groups: list, alive: np.ndarray, tick: int, sensors: Sensors) -> tuple[np.ndarray, ServoCommand]:
    """Actions (n, J) of the living robots and the command to them, each by its own policy."""
    action, target = np.zeros_like(sensors.joint_pos), np.zeros_like(sensors.joint_pos)
    torque, more = np.zeros_like(target), False
    kp, kd = (np.tile(gain, (len(target), 1)) for gain in np.array([gains(joint) for joint in robot_joints()]).T)
    for ids, runner in groups:
        rows = np.flatnonzero(np.isin(alive, ids))
        if len(rows):
            inside = np.searchsorted(ids, alive[rows])
            action[rows], command = runner.step(inside, tick, sensors[rows])
            target[rows] = command.target
            if command.torque is not None:
                torque[rows], more = command.torque, True
            if command.kp is not None:
                kp[rows], kd[rows], more = command.kp, command.kd, True
    return action, ServoCommand(target, torque, kp, kd) if more else ServoCommand(target)


def _fallen(true: Sensors, clips: list[Clip], robots: np.ndarray, tick: int, stop: Stop) -> np.ndarray:
    """Which of the robots lie or are no longer numbers: (n,) bool."""
    reached = (true.base_quat[robots], true.base_pos[robots, 2])
    wanted = (np.array([clip.root_quat[tick] for clip in clips]), np.array([clip.root_pos[tick, 2] for clip in clips]))
    return beyond(stop, *(torch.as_tensor(part, dtype=torch.float64) for part in (*reached, *wanted))).numpy()


def episode_generator(episode: Episode) -> np.random.Generator:
    """Draws of an episode's start and sensor noise, which depend on its motion and seed alone."""
    digest = hashlib.sha256(f"{episode.motion}/{episode.seed}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))
