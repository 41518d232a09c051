"""A torque-driven joint of which data tell strength, inertia and friction up to a factor keeps what was declared."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.selection.proposals.declared_scale import keep_declared_scale
from bumblebee.diagnosis.selection.steps import go
from bumblebee.measured.rollout import Rollout
from tests.diagnosis.selection.test_swap import begun, names

MASS, DRY, VISCOUS = 5.0, 3.0, 4.0  # [kg, N, N s/m]
XML = (
    '<mujoco><option timestep="0.002"/><worldbody><body simple="false">'
    '<joint name="x" type="slide" axis="1 0 0" frictionloss="{}" damping="{}"/>'
    '<geom type="box" size=".2 .1 .1" mass="{}"/></body></worldbody>'
    '<actuator><motor name="x" joint="x"/></actuator></mujoco>'
)


def record(mass: float) -> list[Rollout]:
    """Three rollouts of the sliding mass with friction, at 100 Hz."""
    rng = np.random.default_rng(3)
    model = mujoco.MjModel.from_xml_string(XML.format(DRY, VISCOUS, mass))
    model.opt.timestep = 0.001
    return [one(model, f"r{i}", rng) for i in range(3)]


def one(model: mujoco.MjModel, name: str, rng: np.random.Generator) -> Rollout:
    """A rollout under a multisine of forces."""
    data, time = mujoco.MjData(model), np.arange(400) * 0.01
    waves = [(f, rng.uniform(0, 6)) for f in rng.uniform(0.3, 1.5, 4)]
    force = np.sum([5 * np.sin(2 * np.pi * f * time + p) for f, p in waves], axis=0)
    states = np.empty((len(time), 2))
    for k, u in enumerate(force):
        states[k], data.ctrl[0] = (data.qpos[0], data.qvel[0]), u
        for _ in range(10):
            mujoco.mj_step(model, data)
    states += rng.standard_normal(states.shape) * (1e-4, 2e-3)
    return Rollout(
        name, ("x",), 100.0, time, joint_pos=states[:, :1], joint_vel=states[:, 1:], joint_torque_cmd=force[:, None]
    )


def test_a_common_factor_of_strength_inertia_and_friction_is_taken_out() -> None:
    factor = 1.78
    scaled = {
        ("motor_strength", "x"): factor, ("armature", "x"): (factor - 1) * MASS,
        ("coulomb_friction", "x"): factor * DRY, ("viscous_friction", "x"): factor * VISCOUS,
    }  # fmt: skip
    run = begun(XML.format(0, 0, MASS), record(MASS), scaled)
    assert go(run, keep_declared_scale)
    assert names(run) == [("coulomb_friction", "x"), ("viscous_friction", "x")]
    assert run.fit.values == pytest.approx([DRY, VISCOUS], rel=0.03)


def test_a_drive_that_is_weak_beside_a_declared_mass_stays_weak() -> None:
    weak = {
        ("motor_strength", "x"): 0.6,
        ("coulomb_friction", "x"): 0.6 * DRY,
        ("viscous_friction", "x"): 0.6 * VISCOUS,
    }
    run = begun(XML.format(0, 0, MASS), record(MASS / 0.6), weak)
    assert not go(run, keep_declared_scale)
    assert run.fit.values[0] == pytest.approx(0.6, rel=0.02)
