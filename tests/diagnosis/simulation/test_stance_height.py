"""A base whose height no sensor reads stands on its feet, as they are and not as tilted or shifted sensors say."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.residuals.imu_tilt import raised_by_tilt
from bumblebee.diagnosis.simulation import make_plant
from bumblebee.diagnosis.simulation.chunk import Chunk, Starts
from bumblebee.diagnosis.simulation.starts.base_height import heights_of
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.diagnosis.simulation.windows import Windows, choose_starts, cut
from bumblebee.measured.rollout import Rollout
from bumblebee.quaternions import from_rotation_vector, multiply
from bumblebee.sim.effects import Effect, single
from tests.diagnosis import stander

TILT = np.array([0.06, -0.04, 0.0])


def made(height: bool) -> tuple[Session, Windows, np.ndarray]:
    """Windows of a stander whose sensor leans by `TILT`, with a sensor of the height or without; true heights (W,)."""
    turn = from_rotation_vector(TILT)
    simulated, true = stander.simulate(seed=1)
    leaning = [replace(r, base_quat=multiply(r.base_quat, turn)) for r in simulated]
    rollouts = leaning if height else [replace(r, base_pos=None) for r in leaning]
    session = make_session(mujoco.MjSpec.from_string(stander.XML), rollouts, "stander", "memory")
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 36))
    return session, windows, true[windows.rollout, windows.start]


def begun(session: Session, windows: Windows, *effects: Effect, starts: Starts | None = None) -> np.ndarray:
    """Heights (K, W) at which windows start."""
    chunk = Chunk(session.plant, windows, [vary(session.plant, effects)], starts, 0.005)
    return chunk.begun(np.zeros(1))[0][..., session.plant.base_qpos + 2]


def test_without_a_sensor_of_the_height_a_righted_base_stands_on_its_feet() -> None:
    session, windows, true = made(height=False)
    assert windows.stance
    leaning = np.abs(begun(session, windows) - true)
    righted = np.abs(begun(session, windows, single("imu_offset", "trunk", *TILT[:2])) - true)
    assert np.median(leaning) > 0.008 and righted.max() < 0.0015


def test_perturbed_starts_are_raised_as_the_measured_ones_and_keep_their_distance() -> None:
    session, windows, _ = made(height=False)
    tilt = single("imu_offset", "trunk", *TILT[:2])
    high = np.repeat(windows.qpos[None], 2, axis=0)
    high[1, :, session.plant.base_qpos + 2] += 0.003
    moved = begun(session, windows, tilt, starts=Starts(high, np.repeat(windows.qvel[None], 2, axis=0)))
    np.testing.assert_allclose(moved[0], begun(session, windows, tilt)[0], atol=1e-12)
    np.testing.assert_allclose(moved[1] - moved[0], 0.003, atol=1e-12)


def test_a_measured_height_stays() -> None:
    session, windows, _ = made(height=True)
    assert not windows.stance
    there = begun(session, windows, single("imu_offset", "trunk", *TILT[:2]))
    np.testing.assert_array_equal(there, begun(session, windows))


def test_an_encoder_that_is_off_moves_the_feet_too() -> None:
    """The stander's arm reaches the floor nowhere: its encoder raises nothing."""
    session, windows, _ = made(height=False)
    np.testing.assert_allclose(begun(session, windows, single("encoder_offset", "swing", 0.3)), begun(session, windows))


@pytest.mark.parametrize("axis", [0, 1])
def test_the_slope_of_the_height_is_its_change(axis: int) -> None:
    session, windows, _ = made(height=False)
    plant, now = session.plant, TILT[:2].copy()
    slope = raised_by_tilt(plant, windows, now, 0.01)[axis]
    some = []
    for side in (0.01, -0.01):
        tilt = now.copy()
        tilt[axis] += side
        some.append(begun(session, windows, single("imu_offset", "trunk", *tilt))[0])
    np.testing.assert_allclose(slope, (some[0] - some[1]) / 0.02, atol=1e-9)


def test_heights_of_states_are_those_at_which_the_lowest_point_touches_the_floor() -> None:
    session, windows, _ = made(height=False)
    plant = session.plant
    qpos = windows.qpos[:3].copy()
    qpos[:, plant.base_qpos + 2] = heights_of(plant, qpos) + plant.thresholds.base_height.rest_depth
    data = mujoco.MjData(plant.model)
    for state in qpos:
        data.qpos[:] = state
        mujoco.mj_forward(plant.model, data)
        balls = data.geom_xpos[plant.model.geom_type == int(mujoco.mjtGeom.mjGEOM_SPHERE)]
        assert balls[:, 2].min() == pytest.approx(0.02, abs=1e-9)


def test_feet_that_touch_by_a_named_pair_alone_are_feet() -> None:
    paired = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 .1" contype="0" conaffinity="0"/>
<body name="trunk"><freejoint/><geom name="foot" type="sphere" size=".2" contype="0" conaffinity="0"/>
<body><joint name="j"/><geom size=".05" contype="0" conaffinity="0"/></body></body></worldbody>
<contact><pair geom1="foot" geom2="floor"/></contact></mujoco>"""
    zeros, model = np.zeros((3, 1)), mujoco.MjSpec.from_string(paired)
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    base = {"base_quat": turn, "base_ang_vel": np.zeros((3, 3)), "base_lin_vel": np.zeros((3, 3))}
    log = Rollout("run", ("j",), 50.0, np.arange(3) / 50, zeros, zeros, joint_target=zeros, **base)
    plant = make_plant(model, log, "paired")
    height = heights_of(plant, plant.model.qpos0[None])
    assert height[0] + plant.thresholds.base_height.rest_depth == pytest.approx(0.2)
