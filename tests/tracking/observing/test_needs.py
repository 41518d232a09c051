"""Readings that a policy takes: the rows of each set of observations, and nothing else, depend on it."""

import pytest
import torch

from bumblebee.robot.facts import KEY_BODIES
from bumblebee.tracking.observing.needs import READINGS, _situation, needed
from bumblebee.tracking.observing.terms import LAYOUTS, SETS, expanded, parts, see

ALL = tuple(READINGS)
NEEDS = {
    "demo": ALL,
    "demo_in_place": ALL[:-1],
    "imu": ("imu", "heading", "encoders"),
    "student": ("imu", "heading", "encoders", "height", "place"),
    "gravity_b": ("imu",),
    "root_lin_vel_b": ("velocity",),
    "root_height": ("height",),
    "target_joint_pos": (),
}


@pytest.mark.parametrize("name", NEEDS)
def test_an_observation_needs_the_readings_that_move_it(name: str) -> None:
    assert needed(expanded([name]), 23, 2) == NEEDS[name]


@pytest.mark.parametrize("name", [*LAYOUTS, *SETS])
def test_an_observation_is_as_long_as_its_parts(name: str) -> None:
    state, ref, action = _situation(23, 2)
    assert see(expanded([name]), state, ref, action).shape[1] == sum(size for _, size in parts([name], 23, 2))


def test_a_robot_as_its_reference_has_no_error_of_posture_wherever_it_stands_and_looks() -> None:
    """The reference's rows are those of its own frame: alike for a robot that is elsewhere."""
    state, ref, action = _situation(23, 2)
    object.__setattr__(state, "key_pos_w", ref.key_pos_w + state.root_pos_w[:, None] - ref.root_pos_w[:, None])
    object.__setattr__(state, "root_quat_w", ref.root_quat_w)
    seen, at, rows = see(("imu",), state, ref, action), 0, {}
    for name, size in parts(["imu"], 23, 2):
        rows[name], at = seen[0, at : at + size], at + size
    assert rows["posture_error"].abs().max() < 1e-9 and len(rows["posture_error"]) == 3 * (len(KEY_BODIES) - 1)
    torch.testing.assert_close(rows["ref_rotation"], torch.tensor([1.0, 0, 0, 1, 0, 0], dtype=torch.float64))
    torch.testing.assert_close(rows["ref_joint_pos"], ref.hold_pos[0])
    assert torch.linalg.norm(rows["ahead2_root_pos_o"]) == pytest.approx(
        float(torch.linalg.norm(ref.ahead_root_pos_w[0, 1] - ref.root_pos_w[0]))
    )
