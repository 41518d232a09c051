"""A model made from a drawing: no joint has its rotor's inertia or its friction, and every servo seems slow."""

import re

import pytest

from bumblebee.diagnosis.selection.proposals.all_joints import start
from bumblebee.diagnosis.selection.proposals.gain_grid import gains_by_grid, start_with_gain_grid
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


def test_servos_far_from_the_declared_ones_would_explain_it(run: SearchState) -> None:
    kp = [value for c, value in gains_by_grid(run.problem, run.candidates) if c.effect == "kp"]
    assert len(kp) >= 2 and max(kp) < 0.6


def test_the_search_begins_with_armatures_and_friction_at_the_declared_gains(run: SearchState) -> None:
    assert go(run, start_with_gain_grid)
    found = {(c.effect, c.where): float(run.fit.of(c)[0]) for c in run.fit.chosen}
    for place, value in TRUTH.items():
        assert found[place] == pytest.approx(value, rel=0.15), place
    assert not {"kp", "motor_strength"} & {effect for effect, _ in found}
    assert run.power() < 2.0
    assert run.given == len(run.fit.chosen) and run.tried_many


def _with_gains(run: SearchState) -> None:
    """It begins with gains of a thirtieth and with no armature."""
    assert go(run, start_with_gain_grid)
    found = {(c.effect, c.where): float(run.fit.of(c)[0]) for c in run.fit.chosen}
    for joint in arm.JOINTS:
        assert found["kp", joint] == pytest.approx(1 / 30, rel=0.35)
    assert "armature" not in {effect for effect, _ in found}


def _far_off(windows: int) -> SearchState:
    xml = re.sub(r'kp="(\d+)"', lambda m: f'kp="{30 * int(m[1])}"', arm.XML)
    return begun({}, re.sub(r'kv="(\d+)"', lambda m: f'kv="{10 * int(m[1])}"', xml), windows)


def test_gains_that_are_far_off_stay_gains_where_all_joints_leave_no_less(monkeypatch: pytest.MonkeyPatch) -> None:
    run = _far_off(15)
    monkeypatch.setattr(start, "simulated", lambda *_: run.fit)  # which leaves what the declared model leaves
    _with_gains(run)


@pytest.mark.slow
def test_gains_that_are_far_off_stay_gains() -> None:
    _with_gains(_far_off(60))
