"""A model made from a drawing: no joint has its rotor's inertia or its friction, and every servo seems slow."""

import re
from functools import partial

import pytest

from bumblebee.diagnosis.selection.proposals.all_joints import start_far_off
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.steps import go
from tests.diagnosis import arm
from tests.diagnosis.selection.begun import begun

ARMATURE = dict(zip(arm.JOINTS, (0.4, 0.6, 0.15), strict=True))
FRICTION = dict(zip(arm.JOINTS, (2.0, 3.0, 0.8), strict=True))
TRUTH = {
    **{("armature", joint): value for joint, value in ARMATURE.items()},
    **{("coulomb_friction", joint): value for joint, value in FRICTION.items()},
}


@pytest.fixture(scope="module")
def run() -> SearchState:
    return begun(TRUTH, windows=30)


def test_the_search_begins_with_armatures_and_friction_at_the_declared_gains(run: SearchState) -> None:
    assert go(run, partial(start_far_off, tried=[]))
    found = {(c.effect, c.where): float(run.fit.of(c)[0]) for c in run.fit.chosen}
    for place, value in TRUTH.items():
        assert found[place] == pytest.approx(value, rel=0.15), place
    assert not {"kp", "motor_strength"} & {effect for effect, _ in found}
    assert run.power() < 2.0
    assert run.given == len(run.fit.chosen) and run.tried_many


@pytest.mark.parametrize("windows", [15, pytest.param(60, marks=pytest.mark.slow)])
def test_gains_that_are_far_off_stay_gains(windows: int) -> None:
    """It begins with a thirtieth of the strength, the damping that is lacking then, and no armature."""
    stiff = re.sub(r'kp="(\d+)"', lambda m: f'kp="{30 * int(m[1])}"', arm.XML)
    run = begun({}, re.sub(r'kv="(\d+)"', lambda m: f'kv="{10 * int(m[1])}"', stiff), windows)
    assert go(run, partial(start_far_off, tried=[]))
    found = {(c.effect, c.where): float(run.fit.of(c)[0]) for c in run.fit.chosen}
    for joint, damping in zip(arm.JOINTS, (3.0, 4.0, 2.0), strict=True):
        assert found["motor_strength", joint] == pytest.approx(1 / 30, rel=0.05)
        assert found["viscous_friction", joint] == pytest.approx(2 / 3 * damping, rel=0.1)
    assert "armature" not in {effect for effect, _ in found} and run.power() < 2.0


def test_rotors_beside_half_the_damping_are_found() -> None:
    """Beside a kd that is too large friction cannot be less than none, and drives are at their limits at times."""
    damped = {("viscous_friction", joint): value for joint, value in zip(arm.JOINTS, (0.8, 1.0, 0.5), strict=True)}
    dry = {("coulomb_friction", joint): value for joint, value in zip(arm.JOINTS, (1.2, 2.0, 0.8), strict=True)}
    rotors = {("armature", joint): value for joint, value in zip(arm.JOINTS, (0.5, 0.6, 0.3), strict=True)}
    drawn = re.sub(r'armature="[.0-9]+"', 'armature="0"', arm.XML)
    declared = re.sub(r'kv="(\d+)"', lambda m: f'kv="{2 * int(m[1])}"', drawn)
    run = begun({**damped, **dry, **rotors}, declared, 40)
    assert go(run, partial(start_far_off, tried=[])) and run.power() < 30.0
    found = {(c.effect, c.where): float(run.fit.of(c)[0]) for c in run.fit.chosen}
    for place, rotor in rotors.items():
        assert found[place] == pytest.approx(rotor, rel=0.1), place
