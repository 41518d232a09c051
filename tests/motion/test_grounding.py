"""Floor correction removes what varies slowly, and leaves jumps and good motions alone."""

import numpy as np
import pytest

from bumblebee.motion.grounding import GroundingConfig, ground
from bumblebee.motion.kinematics import forward_bodies, lowest
from bumblebee.quaternions import rotate
from bumblebee.robot.facts import ANKLE_JOINTS, FEET, joint_names

FPS = 50.0


def heights(raw, height: np.ndarray) -> np.ndarray:
    """The root's path with `height` (T,) [m] added."""
    return raw.root_pos + height[:, None] * [0.0, 0.0, 1.0]


@pytest.fixture
def standing(motions):
    return motions.raw(frames=300, fps=FPS)


@pytest.mark.parametrize("offset", [0.12, -0.08])
def test_a_slow_drift_goes(standing, offset):
    drift = offset * (1 - np.cos(np.arange(300) / 300 * np.pi)) / 2 + offset / 2
    config = GroundingConfig(level_ankles=False)
    root_pos, joint_pos = ground(heights(standing, drift), standing.root_quat, standing.joint_pos, FPS, config)
    assert np.abs(lowest(root_pos, standing.root_quat, joint_pos)).max() < 0.01
    np.testing.assert_array_equal(joint_pos, standing.joint_pos)
    np.testing.assert_array_equal(root_pos[:, :2], standing.root_pos[:, :2])


def test_a_jump_keeps_its_height_over_a_floor_that_is_wrong(standing):
    time = np.arange(300) / FPS
    jump = np.where(np.abs(time - 3) < 0.3, 0.3 * (1 - ((time - 3) / 0.3) ** 2), 0)
    config = GroundingConfig(level_ankles=False)
    root_pos, _ = ground(heights(standing, jump + 0.1), standing.root_quat, standing.joint_pos, FPS, config)
    np.testing.assert_allclose(root_pos[:, 2], standing.root_pos[:, 2] + jump, atol=0.01)


def test_a_motion_on_the_floor_and_a_disabled_correction_change_nothing(standing):
    for height, config in ((0.0, GroundingConfig()), (0.02, GroundingConfig()), (0.1, GroundingConfig(method="off"))):
        raised = heights(standing, np.full(300, height))
        root_pos, joint_pos = ground(raised, standing.root_quat, standing.joint_pos, FPS, config)
        np.testing.assert_array_equal(root_pos, raised)
        np.testing.assert_array_equal(joint_pos, standing.joint_pos)


def test_toes_that_point_down_near_the_floor_are_levelled(motions, standing):
    ankles = [joint_names().index(name) for name in ANKLE_JOINTS]
    pitched = np.array(standing.joint_pos)
    pitched[:, ankles[0]] += 0.3
    root_pos = heights(standing, np.full(300, 0.08))

    def tilt(joint_pos: np.ndarray) -> float:
        foot = forward_bodies(root_pos, standing.root_quat, joint_pos)[FEET[0]][1]
        return float(np.arccos(rotate(foot, [0.0, 0.0, 1.0])[:, 2]).max())

    came, levelled = ground(root_pos, standing.root_quat, pitched, FPS, GroundingConfig())
    assert tilt(pitched) > 0.25
    assert tilt(levelled) < 0.05
    assert np.abs(lowest(came, standing.root_quat, levelled)).max() < 0.015
    others = [i for i in range(23) if i not in ankles]
    np.testing.assert_array_equal(levelled[:, others], pitched[:, others])


def test_feet_high_in_the_air_keep_their_ankles(standing):
    lifted = np.array(standing.joint_pos)
    knee, ankle = (joint_names().index(f"left_{name}_joint") for name in ("knee", "ankle_pitch"))
    lifted[:, knee] += 1.2  # the left foot is behind and up throughout
    _, came = ground(heights(standing, np.full(300, 0.1)), standing.root_quat, lifted, FPS, GroundingConfig())
    np.testing.assert_allclose(came[:, ankle], lifted[:, ankle], atol=1e-9)
