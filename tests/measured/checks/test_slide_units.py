"""Units of a slide by the rule `degrees`: metres, and millimetres where these would fit."""

import mujoco
import numpy as np
import pytest

from bumblebee.measured.checks import check_rollout
from bumblebee.measured.rollout import Rollout


@pytest.mark.parametrize("limits", ["range='0 1' limited='true'", ""])
@pytest.mark.parametrize("kind", ["slide", "hinge"])
def test_the_unit_is_named_by_the_kind_of_joint(limits: str, kind: str) -> None:
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><compiler angle='radian'/><worldbody><body><joint name='a' type='{kind}' {limits}/><geom size='.1'/>"
        "<body><joint name='b'/><geom size='.1'/></body></body></worldbody><actuator><position joint='a'/>"
        "<position joint='b'/></actuator></mujoco>"
    )
    time = np.arange(200) / 50
    metres = 0.03 + 0.02 * np.sin(2 * time)
    place = np.stack((1000 * metres, 0.8 * np.sin(time)), axis=1)
    target = np.stack((1000 * metres if limits else metres, 0.8 * np.sin(time)), axis=1) + 1e-4
    rollout = Rollout("r", ("a", "b"), 50.0, time, place, np.gradient(place, time, axis=0), target)
    first = next(finding for finding in check_rollout(rollout, model) if finding.rule == "degrees")
    assert first.column == "joint_pos[a]"
    assert first.expected == ("m, as the joint is a slide" if kind == "slide" else "radians")
    assert first.came.endswith("mm?") == (kind == "slide") and ("degrees" in first.came) <= (kind == "hinge")
