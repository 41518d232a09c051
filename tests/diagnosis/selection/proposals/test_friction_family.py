"""A joint's friction is the sum of the members that are worth their numbers."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.selection.proposals.friction_family import complete_frictions
from bumblebee.diagnosis.selection.steps import go
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm
from tests.diagnosis.selection.test_swap import begun, names
from tests.diagnosis.test_catalogue import CONFIG

MASS, DRY, DRAG = 5.0, 3.0, 1.5  # [kg, N, N s^2/m^2]
LOAD = ("load_dependent_friction", "x")
XML = (
    '<mujoco><option timestep="0.002"/><worldbody><body simple="false"><joint name="x" type="slide" axis="1 0 0"/>'
    f'<geom type="box" size=".2 .1 .1" mass="{MASS}"/></body></worldbody>'
    '<actuator><motor name="x" joint="x"/></actuator></mujoco>'
)


def record(drag: float, forward: float = 0.0, backward: float = 0.0) -> list[Rollout]:
    """Three rollouts of a mass that slides with dry friction and, perhaps, drag; integrated in NumPy, at 100 Hz.

    With `forward` or `backward` the dry friction is this share of the force instead, each for its way.
    """
    rng = np.random.default_rng(3)
    return [one(drag, (forward, backward), f"r{i}", rng) for i in range(3)]


def one(drag: float, shares: tuple[float, float], name: str, rng: np.random.Generator) -> Rollout:
    """A rollout under a multisine of forces."""
    time, dt = np.arange(400) * 0.01, 1e-4
    waves = [(f, rng.uniform(0, 6)) for f in rng.uniform(0.3, 1.5, 4)]
    force = np.sum([7 * np.sin(2 * np.pi * f * time + p) for f, p in waves], axis=0)
    states, (x, v) = np.empty((len(time), 2)), (0.0, 0.0)
    for k, u in enumerate(force):
        states[k] = x, v
        for _ in range(100):
            push = u - drag * v * abs(v)
            free = v + dt * push / MASS
            dry = abs(u) * shares[int(free < 0)] if any(shares) else DRY
            v = np.sign(free) * max(abs(free) - dt * dry / MASS, 0.0)  # dry friction stops, it does not turn round
            x += dt * v
    states += rng.standard_normal(states.shape) * (1e-4, 2e-3)
    return Rollout(
        name, ("x",), 100.0, time, joint_pos=states[:, :1], joint_vel=states[:, 1:], joint_torque_cmd=force[:, None]
    )


def test_a_drag_beside_dry_friction_is_added_by_its_number() -> None:
    run = begun(XML, record(DRAG), {("coulomb_friction", "x"): DRY})
    assert go(run, complete_frictions)
    assert names(run) == [("coulomb_friction", "x"), ("quadratic_friction", "x")]
    assert run.fit.values == pytest.approx([DRY, DRAG], rel=0.05)


def test_dry_friction_alone_stays_alone() -> None:
    run = begun(XML, record(0.0), {("coulomb_friction", "x"): DRY})
    assert not go(run, complete_frictions)
    assert names(run) == [("coulomb_friction", "x")]


def test_a_wrong_member_goes_when_the_right_one_has_come() -> None:
    """Damping that stands for drag."""
    run = begun(XML, record(DRAG), {("coulomb_friction", "x"): DRY, ("viscous_friction", "x"): 1.5})
    assert go(run, complete_frictions)
    assert names(run) == [("coulomb_friction", "x"), ("quadratic_friction", "x")]


def test_friction_that_goes_with_the_load_has_a_coefficient_for_each_direction_where_they_differ() -> None:
    run = begun(XML, record(0.0, 0.4, 0.2), {LOAD: (0.3, 0.0)})
    assert go(run, complete_frictions)
    assert names(run) == [LOAD]
    assert run.fit.values == pytest.approx([0.3, 0.2], rel=0.1)
    (effect,) = run.fit.effects
    assert set(effect.parameters) == {"coefficient", "difference"}


def test_friction_that_goes_with_the_load_alike_both_ways_keeps_one_coefficient() -> None:
    run = begun(XML, record(0.0, 0.3, 0.3), {LOAD: (0.3, 0.0)})
    assert not go(run, complete_frictions)
    assert set(run.fit.effects[0].parameters) == {"coefficient"}


@pytest.mark.slow
@pytest.mark.parametrize(("forward", "backward"), [(0.4, 0.2), (0.3, 0.3)])
def test_a_diagnosis_says_a_difference_between_the_directions_only_where_there_is_one(
    forward: float, backward: float
) -> None:
    session = arm.session_of(record(0.0, forward, backward), XML)
    (entry,) = diagnose(session, replace(CONFIG, max_windows=50, max_holdout_windows=25)).document["effects"]
    assert (entry["effect"], entry["where"]) == (LOAD[0], ["x"])
    truth = {"coefficient": (forward + backward) / 2, "difference": forward - backward}
    assert entry["parameters"].keys() == {name for name, value in truth.items() if value}
    for name, told in entry["parameters"].items():
        assert told["ci95"][0] < truth[name] < told["ci95"][1]


def test_a_constant_torque_that_stands_for_the_difference_goes() -> None:
    run = begun(XML, record(0.0, 0.4, 0.2), {LOAD: (0.3, 0.0), ("asymmetric_friction", "x"): 0.5})
    assert go(run, complete_frictions)
    assert names(run) == [LOAD]
    assert run.fit.values == pytest.approx([0.3, 0.2], rel=0.1)


def test_the_drag_is_in_the_model() -> None:
    """MJCF carries -c v abs(v) by the second coefficient of a joint's damping."""
    spec = mujoco.MjSpec.from_string(XML)
    spec.joint("x").damping = [0.0, DRAG, 0.0]
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[0] = -2.0
    mujoco.mj_forward(model, data)
    assert data.qfrc_damper[0] == pytest.approx(DRAG * 4.0)
