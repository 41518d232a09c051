"""A load that the model does not have is named by its link and its mass, not as gains of all servos."""

from functools import partial

import pytest

from bumblebee.diagnosis.selection.proposals.all_joints import start_far_off
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.steps import go
from tests.diagnosis import arm
from tests.diagnosis.selection.begun import begun

MASS = 3.7  # of 0.7 kg
FRICTION = dict(zip(arm.JOINTS, (2.0, 3.0, 0.8), strict=True))


@pytest.fixture(scope="module")
def run() -> SearchState:
    return begun({("link_mass", "l3"): MASS})


@pytest.mark.parametrize("friction", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_load_is_one_mass_with_or_without_friction_on_all_joints(run: SearchState, friction: bool) -> None:
    dry = FRICTION if friction else {}
    if friction:
        run = begun({("link_mass", "l3"): MASS, **{("coulomb_friction", j): v for j, v in dry.items()}}, windows=60)
    assert go(run, partial(start_far_off, tried=[]))
    found = {(c.effect, c.where): float(run.fit.of(c)[0]) for c in run.fit.chosen}
    assert found["link_mass", "l3"] == pytest.approx(MASS, rel=0.02)
    for joint, size in dry.items():
        assert found["coulomb_friction", joint] == pytest.approx(size, rel=0.15)
    assert not {"kp", "motor_strength"} & {effect for effect, _ in found}
    assert run.power() < 2.0
