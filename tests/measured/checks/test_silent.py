"""Torques that most rows lack are named; those of joints without a drive, at rest, or read anew are not."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.measured.checks import check_rollout
from tests.measured.simulated import arm_model, arm_rollout


def silent(share: float, column: str = "joint_torque", joint: int = 1) -> list[str]:
    rollout = arm_rollout(0)
    torque = np.random.default_rng(0).normal(size=rollout.joint_pos.shape)
    torque[np.random.default_rng(1).uniform(size=len(torque)) < share, joint] = 0.0
    made = replace(rollout, **{column: torque})
    return [f.came for f in check_rollout(made, arm_model()) if f.rule == "silent" and not f.fatal]


@pytest.mark.parametrize("column", ["joint_torque", "joint_torque_cmd"])
def test_a_torque_that_is_zero_in_nine_rows_of_ten_while_the_joint_moves_is_named(column: str) -> None:
    (came,) = silent(0.95, column)
    assert came.startswith("0 in 9")
    assert silent(0.5, column) == [] and silent(0.0, column) == []
