"""A diagnosis names the effect, its joint and its size, and is silent where nothing is missing."""

import numpy as np
import pytest

from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.estimation import gauss_newton
from tests.diagnosis.arm import SMALL

SINGLES = [
    pytest.param("coulomb_friction", "j2", 0.3, 0.05, marks=pytest.mark.slow),
    ("viscous_friction", "j1", 0.3, 0.05),
    ("motor_strength", "j3", 0.85, 0.01),
    pytest.param("command_delay", "j2", 0.013, 0.05, marks=pytest.mark.slow),
    pytest.param("encoder_offset", "j2", 0.03, 0.15, marks=pytest.mark.slow),
    pytest.param("link_mass", "l3", 0.9, 0.02, marks=pytest.mark.slow),
]


@pytest.mark.parametrize("seed", [11, pytest.param(12, marks=pytest.mark.slow)])
def test_a_null_set_raises_no_alarm(diagnosed, seed: int) -> None:
    """A truth that differs by integrator and step alone lacks no effect, and its residual has no structure."""
    document = diagnosed({}, seed).document
    assert document["effects"] == []
    assert not document["unexplained"]["significant"]


@pytest.mark.parametrize(("kind", "place", "value", "tolerance"), SINGLES)
def test_a_single_effect_is_found_alone_with_its_size(
    diagnosed, kind: str, place: str, value: float, tolerance: float
) -> None:
    """The effect, its place and its size, the interval not far off, and nothing beside it."""
    found = diagnosed({(kind, place): value}, seed=3).document["effects"]
    assert [(e["effect"], e["where"]) for e in found] == [(kind, [place])]
    (parameter,) = found[0]["parameters"].values()
    assert parameter["value"] == pytest.approx(value, rel=tolerance)
    low, high = parameter["ci95"]
    assert low - (high - low) <= value <= high + (high - low)


def test_held_out_error_falls_with_the_effect_added(diagnosed) -> None:
    """Most of the whitened excess goes; what stays is the truth's own step and integrator."""
    made = diagnosed({("motor_strength", "j3"): 0.85}, seed=3)
    error = made.document["error"]
    before, after = (error[k]["0.2"]["chi2"]["value"] for k in ("before", "after"))
    assert after - 1 < 0.3 * (before - 1)
    assert error["after"]["0.2"]["joint_pos_rmse"]["value"] < error["before"]["0.2"]["joint_pos_rmse"]["value"]
    weights, fit = np.ones(len(made.problem.windows)), made.search.fit
    fit = gauss_newton(made.problem, fit.chosen, fit.values, weights, iterations=0)
    assert (fit.clean(made.problem) ** 2).mean() < 1.25


def test_whitened_null_residual_has_unit_variance(diagnosed) -> None:
    """Whitening turns the residual of a complete model into noise of variance about one."""
    made = diagnosed({}, 11)
    left = made.search.fit.clean(made.problem)
    assert 0.6 < (left**2).mean() < 1.25


def test_viscous_friction_is_reported_as_the_class_it_shares_with_kd(diagnosed) -> None:
    """Position servos whose velocity target is zero cannot tell joint damping from kd."""
    (found,) = diagnosed({("viscous_friction", "j1"): 0.3}, seed=3).document["effects"]
    assert {"effect": "kd", "where": ["j1"]} in found["equivalent"]


def test_a_lone_rollout_is_diagnosed_and_said_to_be_one(diagnosed) -> None:
    """The effect is still found; the document says that its errors are not held out."""
    document = diagnosed({("motor_strength", "j3"): 0.85}, 5, count=1).document
    assert [(e["effect"], e["where"]) for e in document["effects"]] == [("motor_strength", ["j3"])]
    assert document["holdout"] == []
    assert any("held out" in note for note in document["warnings"])
    assert any("single rollout" in note for note in document["warnings"])


def test_a_joint_that_never_moves_is_unidentifiable(diagnosed) -> None:
    """It is listed, and no effect is claimed on it."""
    document = diagnosed({}, 6, still=0).document
    assert [u["where"] for u in document["unidentifiable"]] == [["j1"]]
    assert all(e["where"] != ["j1"] for e in document["effects"])


def test_the_same_seed_gives_the_same_document(diagnosed) -> None:
    """Nothing but the seed is random."""
    first = diagnosed({}, 11)
    again = diagnose(first.session, SMALL)
    assert np.isclose(again.document["unexplained"]["p"], first.document["unexplained"]["p"])
    assert again.document["error"] == first.document["error"]
