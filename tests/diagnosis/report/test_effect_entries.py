"""The list of effects in `diagnosis.json`: dry friction that changes is one entry with its level."""

import pytest

from bumblebee.diagnosis.diagnose import diagnose
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import Truth, simulate


def entries(truth: Truth) -> list[dict]:
    rollouts = simulate(truth, count=4, seconds=4.0, seed=3)
    session = arm.session_of(rollouts)
    return diagnose(session, arm.SMALL).document["effects"]


def test_friction_that_differs_by_direction_is_one_entry() -> None:
    (found,) = entries({("coulomb_friction", "j2"): (0.5,), ("asymmetric_friction", "j2"): (0.4,)})
    assert (found["effect"], found["where"]) == ("asymmetric_friction", ["j2"])
    sizes = {name: p["value"] for name, p in found["parameters"].items()}
    assert sizes == {"frictionloss": pytest.approx(0.5, rel=0.1), "difference": pytest.approx(0.4, rel=0.1)}
    assert found["parameters"]["frictionloss"]["nominal"] == 0.0
    assert found["explains"] > 0.9 and found["native"]


@pytest.mark.slow
def test_a_difference_that_is_small_beside_the_friction_stays_apart() -> None:
    found = entries({("coulomb_friction", "j2"): (1.2,), ("asymmetric_friction", "j2"): (0.24,)})
    assert [(e["effect"], list(e["parameters"])) for e in found] == [
        ("coulomb_friction", ["frictionloss"]),
        ("asymmetric_friction", ["difference"]),
    ]
