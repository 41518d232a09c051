"""Tries policies on the sealed robots, from readings, as a robot gives them.

Sensor noise, starts and what is judged are those of the robots' search, with a seed of their own; what is followed are
the first seconds of every motion that is held out and of as many training motions of each cluster.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import torch

from benchmarks.baselines.others.library import MovingLibrary
from benchmarks.study.motions import Motions
from bumblebee.evaluation.contract import StartNoise
from bumblebee.evaluation.thinning import thin
from bumblebee.learning.policy import Policy
from bumblebee.learning.rollout import Manner, Tick
from bumblebee.learning.three_rules import ThreeRules
from bumblebee.motion.clip import Clip
from bumblebee.policy.episodes import Episode, episode_generator, start_states
from bumblebee.policy.odometry import placed
from bumblebee.policy.robots import CONTROL_HZ
from bumblebee.policy.runner import robot_state
from bumblebee.robot.sensors import SensorNoise, add_noise, draws
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.body import StandInRobots
from bumblebee.tracking.observing.groups import Group
from bumblebee.tracking.observing.observations import action_middle, action_scale, joint_targets
from bumblebee.tracking.rows import Rows
from tasks.on_robot.stand_in import cut

SEED = 1897
"""Seed of starts and sensor noise; neither the search of the robots nor the rounds use it."""
TRAINED = 40
"""Training motions, shared among the clusters."""


@torch.inference_mode()
def follow_sealed(
    policy: Policy, how: Manner, clips: Sequence[Clip], effects: Sequence[dict[str, Any]], base: str
) -> pd.DataFrame:
    """Roll out each clip once on a sealed robot, the policy seeing readings and the judge the truth.

    Args:
        policy: what acts.
        how: it is run.
        clips: N motions.
        effects: of the robot's sealed file.
        base: what is known of the base's place, one of `stand_in.BASES`.

    Returns:
        the rows of `baselines.trial.follow`.
    """
    n, dt = len(clips), 1.0 / CONTROL_HZ
    library = MovingLibrary(clips, policy.shape.ahead)
    ids, joints = torch.arange(n), library.num_joints
    scale = action_scale() if how.scale is None else torch.full((joints,), how.scale)
    middle = action_middle(policy.shape.action)
    robots, noise = StandInRobots(n, effects), SensorNoise(base=base)
    rngs = [episode_generator(Episode("", "", clip.name, SEED)) for clip in clips]
    qpos, qvel = start_states(clips, rngs, StartNoise())
    robots.reset(qpos, qvel, library.frames(ids, torch.zeros(n)).hold_pos.numpy().astype(np.float64))
    normal = [rng.standard_normal((clip.frames, draws(joints))) for rng, clip in zip(rngs, clips, strict=True)]
    place = placed(noise, qpos[:, :3], rngs, dt)
    group = Group(how.seen, (n, joints, len(library.ahead)), 0.0, torch.device("cpu"))
    generator, judge = torch.Generator(), ThreeRules(clips)
    act, action, everyone = policy.follower(), torch.zeros(n, joints), np.arange(n)
    alive = everyone
    for tick in range(int(library.length.max()) - 1):
        drawn = np.stack([one[min(tick, len(one) - 1)] for one in normal])
        sensors = place(everyone, add_noise(robots.read(), noise, drawn))
        ref = library.frames(ids, torch.full((n,), (tick + 1) * dt))
        group.look(robot_state(sensors), ref, action, Rows(torch.full((n,), tick == 0), by_mask=False), generator)
        action = act(torch.nan_to_num(group.exact))
        target = joint_targets(ref, action, scale, middle).numpy().astype(np.float64)
        robots.step(alive, ServoCommand(target[alive]))
        true = robots.truth()
        broken = torch.as_tensor(~np.isfinite(true.joint_pos).all(1))
        seen = Tick(robot_state(true), ref, tick + 1 < library.length, broken)
        alive = np.flatnonzero(judge.see(seen).numpy())
        if not len(alive):
            break
    return judge.table(dt)


def chosen_clips(motions: Motions, max_seconds: float) -> list[Clip]:
    """Clips to follow: a piece of every held-out motion, and training motions of all clusters, cut."""
    labels = motions.labels
    held = labels[labels["split"] == "test"].drop_duplicates("motion")["name"]
    names = [*held, *thin(labels[labels["split"] == "train"], TRAINED)]
    by_name = {row.clip.name: row.clip for row in motions.rows}
    return [cut(by_name[name], max_seconds) for name in names]
