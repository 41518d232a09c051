"""The sensors' noise from logs of joints that rest: a reading that never changes is no better a sensor for that."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.noise import estimate_noise
from bumblebee.diagnosis.simulation.plant import make_plant
from bumblebee.diagnosis.simulation.readings import layout_of
from bumblebee.diagnosis.thresholds.dataset import Noise
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm

RATE, ROWS = 50.0, 600
PLACE, SPEED = 0.0015, 0.02
"""Steps of the encoder [rad] and of the speed that the drive makes of it [rad/s]."""


def _noise(rollouts: list[Rollout]) -> tuple[np.ndarray, np.ndarray]:
    """Noise of positions and of velocities, (J,)."""
    layout = layout_of(make_plant(mujoco.MjSpec.from_string(arm.XML), rollouts[0], "arm"), False)
    sigma = estimate_noise(rollouts, layout, Noise())
    return sigma[layout.slices["joint_pos"]], sigma[layout.slices["joint_vel"]]


def _read(amplitudes: list[float], seed: int = 0) -> Rollout:
    """Joints that swing by `amplitudes` [rad], read in steps."""
    (made,) = arm.simulate({}, count=1, seconds=ROWS / RATE, seed=seed)
    time = np.arange(made.frames) * float(np.median(np.diff(made.time)))
    swing = np.outer(np.sin(3.0 * time + 0.1), amplitudes)
    speed = np.outer(3.0 * np.cos(3.0 * time + 0.1), amplitudes)
    made.joint_pos[:] = PLACE * np.round(swing / PLACE)
    made.joint_vel[:] = SPEED * np.round(speed / SPEED)
    return made


def test_a_velocity_that_never_changes_is_as_good_as_one_made_from_positions() -> None:
    rollout = _read([0.2, 0.0, 0.2])
    places, speeds = _noise([rollout])
    assert speeds[1] == pytest.approx(rollout.control_hz * places[1])
    assert speeds[0] == pytest.approx(SPEED / np.sqrt(12), rel=0.3), "one that moves has its own"


def test_a_joint_that_rests_in_most_rollouts_is_known_by_those_in_which_it_moves() -> None:
    """A gripper that rests in four rollouts of five has the encoder that its kin have."""
    rollouts = [_read([0.03, 0.03, 0.03 if k == 0 else 0.0], seed=k) for k in range(5)]
    places, speeds = _noise(rollouts)
    assert places == pytest.approx([PLACE / np.sqrt(12)] * 3, rel=0.05)
    assert speeds == pytest.approx([SPEED / np.sqrt(12)] * 3, rel=0.3)


def test_a_reading_that_moves_a_few_times_moves_by_its_step() -> None:
    rollout = _read([0.2, 0.0, 0.2])
    rollout.joint_vel[100:103, 1] = SPEED
    _, speeds = _noise([rollout])
    assert speeds[1] == pytest.approx(SPEED / np.sqrt(12))


def test_white_noise_is_found_as_it_was() -> None:
    rollout = _read([0.2, 0.2, 0.2])
    rollout.joint_pos[:] += 3e-3 * np.random.default_rng(0).standard_normal(rollout.joint_pos.shape)
    places, _ = _noise([rollout])
    assert places == pytest.approx([3e-3] * 3, rel=0.15)


def test_a_rollout_too_short_for_a_block_says_nothing_of_the_noise() -> None:
    rollout = _read([0.2, 0.2, 0.2])
    (short,) = arm.simulate({}, count=1, seconds=0.4, seed=1)
    assert short.frames - 4 < Noise().block
    alone, beside = _noise([rollout]), _noise([rollout, short])
    assert np.allclose(alone, beside, rtol=0.3)
    assert all(np.isfinite(part).all() for part in _noise([short]))
