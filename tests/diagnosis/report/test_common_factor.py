"""Motion alone fixes strengths, friction and inertias up to one factor, and the diagnosis says so."""

import mujoco
import numpy as np

from bumblebee.diagnosis.report.notes import factor_notes
from bumblebee.sim.effects import add_to_spec, single

XML = """
<mujoco><option timestep="0.001"/><worldbody><body><joint name="j" axis="0 1 0"/>
<inertial pos="0 0 -0.3" mass="0.5" diaginertia="0.01 0.01 0.01"/></body></worldbody>
<actuator><motor name="j" joint="j"/></actuator></mujoco>
"""


def _scaled(factor: float) -> np.ndarray:
    spec = mujoco.MjSpec.from_string(XML)
    body = spec.bodies[1]
    body.mass, body.inertia = factor * body.mass, factor * body.inertia
    add_to_spec(
        spec,
        [
            single("viscous_friction", "j", 0.05 * factor),
            single("armature", "j", 0.02 * factor),
            single("motor_strength", "j", factor),
        ],
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    path = []
    for k in range(1500):
        data.ctrl[0] = 1.2 * np.sin(0.004 * k)
        mujoco.mj_step(model, data)
        path.append(data.qpos[0])
    return np.array(path)


def test_all_forces_times_one_factor_move_the_same() -> None:
    assert np.abs(_scaled(1.0)).max() > 0.5
    np.testing.assert_allclose(_scaled(1.7), _scaled(1.0), atol=1e-9)


def test_it_is_said_where_no_drive_keeps_its_strength() -> None:
    strength = [{"effect": "motor_strength", "where": [name]} for name in ("a", "b")]
    friction = {"effect": "coulomb_friction", "where": ["a"]}
    assert len(factor_notes([*strength, friction], ["a", "b"])) == 1
    assert factor_notes([strength[0], friction], ["a", "b"]) == []
    assert factor_notes([], []) == []
