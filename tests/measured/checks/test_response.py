"""A waist that leans against its load in a squat, as the demo's rollouts have it, and signs that are truly wrong."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee.learning import pretrained
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import load_policy
from bumblebee.measured.checks import check_rollout
from bumblebee.measured.rollout import Rollout
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.robot.sensors import SensorNoise
from bumblebee.stand_in.body import StandInRobots
from tests.measured.simulated import clip_and_lead, g1_model


@pytest.fixture(scope="module")
def squat(tmp_path_factory: pytest.TempPathFactory) -> Rollout:
    """A shallow squat by the policy that comes along on the stand-in robot, on which nothing is wrong."""
    folder: Path = tmp_path_factory.mktemp("policy")
    export_policy(folder, load_policy(pretrained.FOLDER))
    clip, _ = clip_and_lead("squat_shallow")
    episodes, policies = [Episode("squat", "p", clip.name, 1100)], {"p": ExportedPolicy.load(folder)}
    robots = lambda count: StandInRobots(count, [])  # noqa: E731
    (rollout,) = run_episodes(robots, episodes, policies, {clip.name: clip}, SensorNoise())
    return rollout


def test_a_waist_whose_position_goes_against_its_target_under_load_is_no_reversed_sign(squat: Rollout) -> None:
    waist = squat.joints.index("waist_pitch_joint")
    changes = [values[5:, waist] - values[:-5, waist] for values in (squat.joint_pos, squat.joint_target)]
    assert np.corrcoef(*changes)[0, 1] < -0.8  # it looks reversed
    assert check_rollout(squat, g1_model()) == []


def test_a_joint_that_is_truly_reversed_in_the_same_squat_is_named(squat: Rollout) -> None:
    sign = np.where(np.array(squat.joints) == "left_elbow_joint", -1.0, 1.0)
    turned = replace(squat, joint_pos=sign * squat.joint_pos, joint_vel=sign * squat.joint_vel)
    found = {f.column for f in check_rollout(turned, g1_model()) if f.rule == "response-sign" and f.fatal}
    assert found == {"joint_target[left_elbow_joint]"}
