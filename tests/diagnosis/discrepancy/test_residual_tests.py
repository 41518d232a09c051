"""Structure beyond the catalogue: none where there is none; where there is, the joint, the quantities and the form."""

import numpy as np
import pytest

from bumblebee.diagnosis.gap.dependence_test import joint_curves, joint_structure
from bumblebee.diagnosis.gap.sparse_regression import find_form
from bumblebee.diagnosis.gap.torque_residual import TorqueResidual

JOINTS = ("hip", "knee")


def data(missing: object, seed: int, noise: float = 0.3, seconds: float = 60.0) -> TorqueResidual:
    """Windows of 0.04 s along smooth motions; `missing(q, v, tau, t)` is the torque that the hip lacks."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 0.04)
    amp, freq, phase = rng.uniform(0.2, 0.5, (3, 2)), rng.uniform(0.1, 0.8, (3, 2)), rng.uniform(0, 6.28, (3, 2))
    angle = 2 * np.pi * freq * t[:, None, None] + phase
    q, v = (amp * np.sin(angle)).sum(axis=1), (2 * np.pi * freq * amp * np.cos(angle)).sum(axis=1)
    u = q + 0.1 * v + 0.05 * rng.standard_normal(q.shape).cumsum(axis=0) / 30
    tau = 30 * (u - q) - 1.0 * v
    lacks = noise * rng.standard_normal(q.shape)
    lacks[:, 0] += missing(q, v, tau[:, 0], t) if missing else 0.0
    zeros = np.zeros((*q.shape, 3))
    block = np.unique((t / 0.5).astype(int), return_inverse=True)[1]
    return TorqueResidual(JOINTS, np.zeros(len(t), int), block, lacks, q, v, u, v, tau, t, zeros, np.full(2, 0.02))


def test_noise_has_no_structure() -> None:
    alarms = [
        joint_structure(data(None, 2 * seed), data(None, 2 * seed + 1), joint).significant
        for seed in range(12)
        for joint in range(2)
    ]
    assert sum(alarms) <= 1


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


def test_a_measured_curve_is_the_mean_with_an_interval_that_covers() -> None:
    wanted = lambda q, v, tau, t: -0.5 * np.tanh(4 * v[:, 0])  # noqa: E731
    rows = np.array(joint_curves(data(wanted, 3), 0)["velocity [rad/s]"])
    off = np.abs(rows[:, 1] + 0.5 * np.tanh(4 * rows[:, 0]))
    assert len(rows) == 15 and (off < rows[:, 2]).mean() > 0.8
