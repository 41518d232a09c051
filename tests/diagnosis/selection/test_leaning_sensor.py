"""A sensor of the base that leans, without one of its height: found alone with its size, and nothing in its place."""

from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.quaternions import from_rotation_vector, multiply
from tests.diagnosis import arm, stander

TILT = np.array([0.05, -0.03])


def test_a_large_tilt_is_found_alone_with_its_size_where_the_height_is_taken_from_stance() -> None:
    """Where windows stayed whitened around none, the roll came out as .016 and the ground as sloped by a third."""
    turn, (simulated, _) = from_rotation_vector(np.append(TILT, 0.0)), stander.simulate(seed=1, count=6)
    leaning = [replace(r, base_quat=multiply(r.base_quat, turn), base_pos=None) for r in simulated]
    session = make_session(mujoco.MjSpec.from_string(stander.XML), leaning, "stander", "memory")
    found = diagnose(session, replace(arm.SMALL, beyond=False)).document["effects"]
    assert [(e["effect"], e["where"]) for e in found] == [("imu_offset", ["trunk"])]
    for name, true in zip(("roll", "pitch"), TILT, strict=True):
        low, high = found[0]["parameters"][name]["ci95"]
        assert low - 2e-4 < true < high + 2e-4 and high - low < 0.002
