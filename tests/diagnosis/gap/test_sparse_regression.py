"""Structure beyond the catalogue: where there is some, the joint, the quantities and the form."""

import numpy as np
import pytest

from bumblebee.diagnosis.gap.dependence_test import joint_structure
from bumblebee.diagnosis.gap.sparse_regression import find_form
from tests.diagnosis.gap.made import data


@pytest.mark.parametrize(
    ("missing", "on", "terms"),
    [
        (lambda q, v, tau, t: 0.4 * np.sin(12 * q[:, 0]), "position", {"sin(12*q)": 0.4}),
        (lambda q, v, tau, t: -0.5 * q[:, 0] ** 3, "position", {"q^3": -0.5}),
        (lambda q, v, tau, t: -0.3 * v[:, 0] * np.abs(v[:, 0]), "velocity", {"v*abs(v)": -0.3}),
        (lambda q, v, tau, t: -0.15 * np.abs(tau) * np.sign(v[:, 0]), "torque", {"friction(abs(tau))": 0.15}),
        (lambda q, v, tau, t: -0.008 * t * tau, "torque", {"t*tau": -0.008}),
        (lambda q, v, tau, t: 0.3 * v[:, 1], "another joint (knee)", {"v[knee]": 0.3}),
        (lambda q, v, tau, t: -0.4 * (1 + np.cos(3 * q[:, 0])) * np.sign(v[:, 0]), "velocity",
         {"friction(1 + cos(3*q))": 0.4}),
    ],
    ids=["cogging", "cubic spring", "drag", "load friction", "fading", "coupling", "uneven friction"],
)  # fmt: skip
def test_the_joint_the_quantity_and_the_form_are_found(missing: object, on: str, terms: dict[str, float]) -> None:
    train, held = data(missing, 100), data(missing, 101, seconds=30.0)
    hip, knee = (joint_structure(train, held, joint) for joint in range(2))
    assert hip.significant and not knee.significant
    assert on in hip.depends_on
    form = find_form(train, held, 0, hip.share)
    assert form.kind == "formula"
    for term, value in terms.items():
        assert form.terms[term] == pytest.approx(value, rel=0.15)


def test_a_shape_that_no_formula_has_is_given_as_a_curve() -> None:
    step = lambda q, v, tau, t: 0.8 * ((q[:, 0] > -0.4) & (q[:, 0] < -0.1)) - 0.5 * (q[:, 0] > 0.3)  # noqa: E731
    train, held = data(step, 7, noise=0.1), data(step, 8, noise=0.1)
    hip = joint_structure(train, held, 0)
    form = find_form(train, held, 0, hip.share)
    assert hip.depends_on[0] == "position"
    assert form.share > 0.6 * hip.share
    if form.kind == "curve":
        assert next(iter(form.terms)).startswith("curve(q,")
