"""Drives with a filter: a window begins with what the commands before it have made of the filter's state."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.sensitivities import answers_of
from bumblebee.diagnosis.simulation import activations, choose_starts, cut, residuals, vary
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect
from tests.diagnosis.arm import session_of

LAG, HZ = 0.02, 100.0  # [s], [1/s]
XML = f"""<mujoco model="filtered"><option timestep="0.001" integrator="implicitfast"/><worldbody><body name="link">
<joint name="j" axis="0 1 0" damping=".1" armature=".02"/><inertial pos="0 0 .1" mass=".5" diaginertia=".01 .01 .01"/>
</body></worldbody><actuator><general joint="j" gainprm="20" biastype="affine" biasprm="0 -20 -1" dyntype="filterexact"
dynprm="{LAG}"/></actuator></mujoco>"""


def record() -> Rollout:
    """Three seconds under sines, without noise."""
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    time = np.arange(round(3.0 * HZ)) / HZ
    told = 0.5 * np.sin(9.0 * time) + 0.3 * np.sin(23.0 * time + 1.0)
    place, speed = np.empty_like(time), np.empty_like(time)
    for k, target in enumerate(told):
        place[k], speed[k] = data.qpos[0], data.qvel[0]
        data.ctrl[0] = target
        mujoco.mj_step(model, data, round(1.0 / HZ / model.opt.timestep))
    return Rollout("r", ("j",), HZ, time, place[:, None], speed[:, None], joint_target=told[:, None])


@pytest.fixture
def session():
    """The declared model with what it has done itself."""
    return session_of([record()], XML)


def test_a_declared_drive_with_a_filter_is_followed_from_the_middle_of_its_log(session) -> None:
    plant = session.plant
    windows = cut(plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, 8))
    left = residuals(plant, session.layout, windows, [vary(plant, [])], 0.001)[0]
    assert np.abs(left[..., 0]).max() < 1e-4  # [rad]
    asleep = replace(windows, command=windows.command * (windows.command_time >= 0)[..., None])
    assert np.abs(residuals(plant, session.layout, asleep, [vary(plant, [])], 0.001)[0][..., 0]).max() > 1e-2


def test_the_state_is_the_lag_of_the_delayed_commands(session) -> None:
    plant = session.plant
    windows = cut(plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, 8))
    delay = 0.004
    variation = vary(plant, [Effect("command_delay", ("j",), {"delay": delay})])
    found = activations(windows, variation, np.full((len(windows), 1), np.nan))
    for w in range(len(windows)):
        state, fine = windows.command[w, 0, 0], 1e-5
        for now in np.arange(windows.command_time[w, 0], 0.0, fine):
            at = max(0, np.searchsorted(windows.command_time[w], now - delay + 1e-9) - 1)
            state += fine / LAG * (windows.command[w, at, 0] - state)
        assert found[w, 0] == pytest.approx(state, abs=2e-3)


def test_without_a_torque_the_path_that_is_pushed_goes_on_as_it_was(session) -> None:
    """A pulse that begins in the middle of a window finds the filter as it is there: pulses of two sizes agree."""
    plant = session.plant
    windows = cut(plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, 8))
    small, large = (
        answers_of(plant, session.layout, windows, vary(plant, []), 0.002, np.array([size])).torque
        for size in (0.01, 0.02)
    )
    np.testing.assert_allclose(small, large, atol=1e-3 * np.abs(large).max())
