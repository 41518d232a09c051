"""Motors that turn with two joints: their equations integrated in NumPy, and where they can sit."""

import mujoco
import numpy as np
import pytest

from bumblebee.effects.coupled import joint_before
from bumblebee.errors import BadInput
from bumblebee.sim.effects import add_to_spec, single

INERTIAS = np.array([0.05, 0.02])
XML = """<mujoco><compiler angle="radian"/><option timestep="1e-4" gravity="0 0 0" integrator="Euler"/><worldbody>
<body name="yoke"><joint name="pitch" axis="0 1 0" armature=".05"/><inertial pos="0 0 0" mass="1e-6"
 diaginertia="1e-9 1e-9 1e-9"/>
<body name="hand"><joint name="roll" axis="1 0 0" armature=".02"/><inertial pos="0 0 0" mass="1e-6"
 diaginertia="1e-9 1e-9 1e-9"/></body></body></worldbody>
<actuator><motor name="pitch" joint="pitch"/><motor name="roll" joint="roll"/></actuator></mujoco>"""


def push(t: float) -> np.ndarray:
    return np.array([0.4 * np.sin(5 * t), 0.3 * np.sin(9 * t + 1)])


def by_mujoco(effect: str, *values: float) -> np.ndarray:
    spec = mujoco.MjSpec.from_string(XML)
    add_to_spec(spec, [single(effect, "roll", *values)])
    model = spec.compile()
    data, path = mujoco.MjData(model), []
    for k in range(10_000):
        data.ctrl[:] = push(k * 1e-4)
        mujoco.mj_step(model, data)
        path.append(data.qpos.copy())
    return np.array(path)


def by_hand(effect: str, *values: float) -> np.ndarray:
    """Semi-implicit Euler of both rotors, with the torque or the inertia along the motors' angles."""
    *sizes, ratio = values
    ways = np.array([[ratio, 1.0], [-ratio, 1.0]])[: len(sizes)]
    mass, q, v, path = np.diag(INERTIAS), np.zeros(2), np.zeros(2), []
    if effect == "coupled_armature":
        mass = mass + sum(size * np.outer(way, way) for size, way in zip(sizes, ways, strict=True))
    for k in range(10_000):
        force = push(k * 1e-4)
        for size, way in zip(sizes, ways, strict=True):
            rate = way @ v
            torque = {"coupled_friction": np.tanh(rate / 2e-3), "coupled_damping": rate}.get(effect, 0.0)
            force = force - size * torque * way
        v = v + 1e-4 * np.linalg.solve(mass, force)
        q = q + 1e-4 * v
        path.append(q)
    return np.array(path)


@pytest.mark.parametrize(
    ("effect", "values", "near"),
    [
        ("coupled_friction", (0.06, 0.0, 1.0), 0.01),
        ("coupled_friction", (0.02, 0.05, 0.7), 0.01),
        ("coupled_damping", (0.2, 1.0), 1e-3),
        ("coupled_damping", (0.3, -1.5), 1e-3),
        ("coupled_armature", (0.03, 1.0), 1e-3),
        ("coupled_armature", (0.04, -0.6), 1e-3),
    ],
)
def test_both_motors_follow_their_equation(effect: str, values: tuple[float, ...], near: float) -> None:
    expected, plain = by_hand(effect, *values), by_hand("none", 1.0)
    moved = np.abs(expected - plain).max()
    assert moved > 0.05
    assert np.abs(by_mujoco(effect, *values) - expected).max() < near * np.abs(expected).max()


def test_the_joint_before_is_the_next_one_towards_the_base() -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    assert joint_before(model, "roll") == "pitch"
    assert joint_before(model, "pitch") == ""


def test_a_joint_with_none_before_it_is_refused() -> None:
    with pytest.raises(BadInput, match="a joint with another one before it"):
        add_to_spec(mujoco.MjSpec.from_string(XML), [single("coupled_damping", "pitch", 0.1, 1.0)])
