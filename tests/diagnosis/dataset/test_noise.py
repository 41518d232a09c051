"""The sensors' noise from logs at rest: a velocity that never changes is no better a sensor for that."""

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
    """Of positions and of velocities, (J,)."""
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


def test_velocities_that_never_change_are_as_good_as_ones_made_from_positions() -> None:
    """A driver that rounds them to 0 where the robot rests."""
    rollout = _read([0.02, 0.02, 0.02])
    rollout.joint_vel[:] = 0.0
    places, speeds = _noise([rollout])
    assert speeds == pytest.approx(rollout.control_hz * places)


def test_a_velocity_that_moves_a_few_times_moves_by_its_step() -> None:
    """In one rollout of three; without it such a speed was held to 1e-5 rad/s."""
    rollouts = [_read([0.02, 0.02, 0.02], seed=k) for k in range(3)]
    for rollout in rollouts:
        rollout.joint_vel[:] = 0.0
    rollouts[1].joint_vel[100:103] = SPEED
    assert _noise(rollouts)[1] == pytest.approx([SPEED / np.sqrt(12)] * 3)


def test_velocities_with_a_noise_of_their_own_keep_it() -> None:
    rollout = _read([0.2, 0.2, 0.2])
    rollout.joint_vel[:] += 3e-5 * np.random.default_rng(0).standard_normal(rollout.joint_vel.shape)
    rollout.joint_vel[:, 1] = 3e-5 * np.random.default_rng(1).standard_normal(rollout.frames)
    assert _noise([rollout])[1][1] < SPEED / np.sqrt(12)


def test_white_noise_is_found_as_it_was() -> None:
    rollout = _read([0.2, 0.2, 0.2])
    rollout.joint_pos[:] += 3e-3 * np.random.default_rng(0).standard_normal(rollout.joint_pos.shape)
    places, _ = _noise([rollout])
    assert places == pytest.approx([3e-3] * 3, rel=0.15)
