"""Measured rollouts as windows of the world model: states, targets, gaps, and what cannot be used."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.learning.world_model.measured import measured, regular
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.sensors import load_model
from tests.learning.swaying import record

DT = 0.02


@pytest.fixture(scope="module")
def rollouts() -> list[Rollout]:
    return record(worlds=2, ticks=40)


def rows_of(rollout: Rollout, rows: np.ndarray, shift: np.ndarray | float = 0.0) -> Rollout:
    """Some rows of a rollout, with their time stamps shifted [s]."""
    columns = {name: getattr(rollout, name)[rows] for name in ("time", *rollout.columns)}
    return replace(rollout, **columns | {"time": columns["time"] + shift})


def test_windows_hold_the_logged_states_the_targets_held_and_those_before_them(rollouts: list[Rollout]) -> None:
    own = measured(rollouts, load_model(), DT, 10)
    rows = own.first_rows(8, past=2)
    window = own.windows(rows, 8, past=2, context=3)
    one = list(rows).index(40 + 5)  # the second rollout's row 5
    second = rollouts[1]
    np.testing.assert_allclose(window.bodies[:, one, 13:36], second.joint_pos[5:14], atol=1e-6)
    np.testing.assert_allclose(window.bodies[:, one, 7:10], second.base_lin_vel[5:14], atol=1e-5)
    np.testing.assert_allclose(window.targets[:, one], second.joint_target[5:13], atol=1e-6)
    np.testing.assert_allclose(window.before[one], second.joint_target[[4, 3]].ravel(), atol=1e-6)
    assert window.valid.all() and window.context.shape == (len(rows), 3) and not window.context.any()
    assert own.provenance == {"r0": 39, "r1": 39}


def test_a_log_of_steady_time_stays_as_it_is_and_one_that_wanders_is_interpolated(rollouts: list[Rollout]) -> None:
    rollout = rollouts[0]
    (same,) = regular(rollout, DT)
    for name in rollout.columns:
        np.testing.assert_allclose(getattr(same, name), getattr(rollout, name), atol=1e-9)
    wander = np.linspace(0, 0.9, rollout.frames) % 0.3 * DT
    values = (rollout.time + wander)[:, None] * np.ones(len(rollout.joints))  # a joint that turns steadily
    (even,) = regular(replace(rollout, time=rollout.time + wander, joint_pos=values), DT)
    np.testing.assert_allclose(even.joint_pos[:, 0], even.time, atol=1e-9)
    np.testing.assert_allclose(np.diff(even.time), DT, atol=1e-9)
    np.testing.assert_array_equal(even.joint_target, rollout.joint_target[: even.frames])


def test_no_window_reaches_over_a_missing_tick(rollouts: list[Rollout]) -> None:
    holed = rows_of(rollouts[0], np.delete(np.arange(40), 20))
    own = measured([holed], load_model(), DT, 5)
    assert own.recordings.length.tolist() == [20, 19] and own.provenance == {"r0": 37}
    assert own.first_rows(10, past=1).tolist() == [*range(1, 10), *range(21, 29)]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"control_hz": 100.0}, "r0: control_hz: expected the world model's 50 Hz, came 100 Hz"),
        ({"base_lin_vel": None}, "r0: column base_lin_vel: expected a logged column, came none"),
        ({"base_quat": None}, "r0: column base_quat: expected a logged column"),
        ({"joints": tuple(map(str, range(23)))}, "r0: joints: expected the G1's 23, came 23 joints, of which"),
    ],
)
def test_another_robot_rate_or_a_base_that_was_not_logged_is_one_line(
    rollouts: list[Rollout], change: dict, said: str
) -> None:
    with pytest.raises(BadInput) as raised:
        measured([replace(rollouts[0], **change)], load_model(), DT, 10)
    assert str(raised.value).startswith(said)


def test_stretches_that_are_all_too_short_are_one_line(rollouts: list[Rollout]) -> None:
    with pytest.raises(BadInput, match=r"expected one of 1 s without a gap, came 2 rollouts, the longest of 0.78 s"):
        measured(rollouts, load_model(), DT, 50)
