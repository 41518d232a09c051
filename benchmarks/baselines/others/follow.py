"""How well any policy follows clips in MuJoCo C: success, MPJPE and MPKPE, in the world and over the robot's own place.

The same rule for every policy, whatever ended its episodes in training: from the first frame to the last, without
noise; lost where a key body is farther from its reference than the family's threshold, or the robot has fallen.
"""

from collections.abc import Sequence

import mujoco
import pandas as pd
import torch

from benchmarks.baselines.others import env as _registered  # noqa: F401, the terms of the baselines
from benchmarks.baselines.others.library import MovingLibrary
from bumblebee.learning.policy import Policy
from bumblebee.learning.rollout import Manner, roll_out
from bumblebee.learning.three_rules import ThreeRules
from bumblebee.motion.clip import Clip
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import Randomisation
from bumblebee.tracking.worlds.randomisation import randomise_worlds

ROBOTS_SEED = 11
"""Seed of robots that differ, the same for all policies."""


@torch.inference_mode()
def follow(
    policy: Policy,
    manner: Manner,
    clips: Sequence[Clip],
    model: mujoco.MjModel,
    threads: int = 1,
    robots: Randomisation | None = None,
) -> pd.DataFrame:
    """Roll out each clip once.

    Args:
        policy: what acts.
        manner: how it is run.
        clips: N motions.
        model: the robot, with room for the delays of `robots`.
        threads: of the physics.
        robots: how much each clip's robot differs from `model`, drawn with a fixed seed, without pushes; None: not.

    Returns:
        a row a clip: name, family, split, seconds; success and lost_at [s]; success_local, by distances after the
        reference's root was moved over the robot's, which forgives drift; success_upright, by `upright`; mpjpe_rad,
        mpkpe_mm and mpkpe_local_mm over the frames before the loss.
    """
    library = MovingLibrary(clips, policy.shape.ahead)
    engine = make_engine("mujoco", model, len(clips), min(threads, len(clips)))
    if robots is not None:
        randomise_worlds(engine, robots, ROBOTS_SEED)
    judge = ThreeRules(clips)
    for tick in roll_out(policy, manner, library, engine):
        if not bool(judge.see(tick).any()):
            break
    return judge.table(engine.control_dt)
