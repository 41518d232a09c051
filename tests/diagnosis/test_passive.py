"""Robots without any drive: what swings freely says as much of masses and friction as what is driven."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.measured.rollout import Rollout
from tests.diagnosis.arm import session_of

_XML = """<mujoco><option timestep="0.002"/><worldbody><body name="a" pos="0 0 1"><joint name="j1" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02" mass=".5"/><body name="b" pos="0 0 -.3">
<joint name="j2" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02" mass=".3"/></body></body>
</worldbody></mujoco>"""


def _swing(seed: int) -> Rollout:
    """4 s at 100 Hz of a pendulum whose lower link weighs .36 kg, evenly, and whose upper joint rubs by .004 v."""
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec.from_string(_XML)
    spec.body("b").geoms[0].mass = 0.36
    model = spec.compile()
    model.opt.timestep = 0.001
    data = mujoco.MjData(model)
    data.qpos[:] = rng.uniform(-2, 2, 2)
    rows = []
    for _ in range(400):
        rows.append(np.concatenate((data.qpos, data.qvel)))
        for _ in range(10):
            data.qfrc_applied[0] = -0.004 * data.qvel[0]
            mujoco.mj_step(model, data)
    read = np.array(rows) + rng.standard_normal((400, 4)) * [5e-4, 5e-4, 5e-3, 5e-3]
    none = np.zeros((400, 2))
    return Rollout(
        f"r{seed}", ("j1", "j2"), 100.0, np.arange(400) / 100, read[:, :2], read[:, 2:], joint_torque_cmd=none
    )


def test_a_free_double_pendulum_tells_its_mass_and_its_friction() -> None:
    session = session_of([_swing(seed) for seed in range(4)], _XML)
    config = DiagnosisConfig(max_windows=40, max_holdout_windows=20, report_windows=6, grow=False, beyond=False)
    found = diagnose(session, config).document["effects"]
    assert [(e["effect"], e["where"]) for e in found] == [("link_mass", ["b"]), ("viscous_friction", ["j1"])]
    mass, friction = found[0]["parameters"], found[1]["parameters"]
    assert mass["mass"]["value"] == pytest.approx(0.36, rel=0.01) and mass["spread"]["value"] == 1.0
    assert friction["damping"]["value"] == pytest.approx(0.004, rel=0.05)
