"""Evidence on missing torques: sizes and gains as a fit finds them, functions whose text and torque are the same."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.signal_scales import scales_of
from bumblebee.diagnosis.comparison.paired_tests import confirmed
from bumblebee.diagnosis.discrepancy.missing_torque import Scene, fitted_scene
from bumblebee.diagnosis.discrepancy.residual_tests import JointActivity, in_whole, lack_of_fit
from bumblebee.diagnosis.discrepancy.stepwise_regression import library, seek
from bumblebee.diagnosis.discrepancy.term_library import BasisFunction, basis_functions, joined, neighbours
from bumblebee.diagnosis.discrepancy.torque_scores import Evidence
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.estimation.least_squares import cost_of
from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.thresholds.comparison import Confirmed
from bumblebee.diagnosis.thresholds.discrepancy import TermLibrary
from bumblebee.sim.effects import read_term
from tests.diagnosis.discrepancy.test_discover import prepared

_made: list[tuple[Problem, Scene]] = []


def null() -> tuple[Problem, Scene]:
    """The windows of a complete model, made once."""
    if not _made:
        session, problem, _ = prepared()
        fit = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
        _made.append((problem, fitted_scene(problem, fit, scales_of(session.plant, session.rollouts).torque)))
    return _made[0]


def planted(size: float) -> tuple[Problem, Scene, Evidence, np.ndarray]:
    """The evidence where the pole lacks `size` times its target's distance, to first order."""
    problem, scene = null()
    torque = np.stack([scene.data.torque(read_term("sin(4*q)"), 1)])
    residual = scene.residual + size * scene.evidence.column(1, torque)[0]
    return problem, scene, scene.evidence.with_columns(problem, residual, scene.columns), torque


def test_a_planted_torque_comes_back_with_its_size() -> None:
    _, _, evidence, torque = planted(0.2)
    verdict = evidence.test(1, torque)
    assert abs(verdict.size[0] - 0.2) < 3 * verdict.error[0]
    assert verdict.z > 10


def test_a_chi_square_that_two_windows_hold_is_gone_with_them() -> None:
    problem, scene = null()
    torque = np.zeros((1, *scene.evidence.score.shape[1:]))
    torque[0, [3, 7]] = 5.0
    residual = scene.residual + scene.evidence.column(1, torque)[0]
    evidence = scene.evidence.with_columns(problem, residual, scene.columns)
    (loud, count), (rest, fewer) = evidence.chi_square(1), evidence.chi_square(1, spared=2)
    assert (loud - count) / np.sqrt(2 * count) > 10 > 4 > (rest - fewer) / np.sqrt(2 * fewer)
    assert fewer < count
    assert evidence.chi_square(1, spared=len(problem.windows) + 1) == (0.0, 0)


def test_on_a_base_that_can_fall_the_loudest_windows_of_a_rollout_are_no_structure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two windows of each rollout lack a torque: on a fixed base that counts, where a foot may tip it does not."""
    problem, scene = null()
    of = problem.windows.rollout
    torque = np.zeros((1, *scene.evidence.score.shape[1:]))
    some = [k for i in np.unique(of) for k in np.flatnonzero(of == i)[[1, 4]]]
    torque[0, some] = 0.05 * np.random.default_rng(0).choice([-1.0, 1.0], (len(some), torque.shape[-1]))
    residual = scene.residual + scene.evidence.column(1, torque)[0]
    loud = replace(scene, residual=residual)
    assert loud.excess()[1] > 10 > 4 > loud.excess(2)[1]
    fit = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    monkeypatch.setattr("bumblebee.diagnosis.discrepancy.residual_tests.fitted_scene", lambda *_: loud)
    assert lack_of_fit(problem, None, fit, JointActivity(scene.torque)).joints[1].significant
    may_fall = replace(problem, plant=replace(problem.plant, floating=True))
    assert not lack_of_fit(may_fall, None, fit, JointActivity(scene.torque)).joints[1].significant


def test_windows_further_off_than_noise_are_seen_whatever_the_reason() -> None:
    """A residual that no torque makes: noise of one and a half times the size in all that the windows compare."""
    _, scene = null()
    more = np.random.default_rng(3).standard_normal(scene.residual.shape)
    loud = replace(scene, residual=scene.residual + more)
    assert in_whole(loud, None).significant and in_whole(loud, loud).significant
    assert not in_whole(scene, None).significant
    assert not in_whole(loud, scene).significant and not in_whole(scene, loud).significant
    assert loud.reduced_chi_square()[0] == pytest.approx(scene.reduced_chi_square()[0] + 1.0, rel=0.1)


def test_a_scene_of_one_joint_says_of_it_what_the_whole_one_says() -> None:
    _, scene = null()
    one = replace(scene, joints=[1])
    assert one.quiet_excess(1) == pytest.approx(scene.quiet_excess(1), rel=1e-6)
    assert one.excess()[0] == 0.0 != scene.excess()[0]


def test_a_gain_is_the_fall_of_the_cost_of_a_fit_with_the_column() -> None:
    problem, scene, evidence, torque = planted(0.2)
    residual = scene.residual + 0.2 * evidence.column(1, torque)[0]
    before, _ = cost_of(problem, residual, evidence.weights)
    more = np.concatenate((problem.nuisance, evidence.column(1, torque)))
    flat = (more * np.sqrt(evidence.weights)[:, None]).reshape(len(more), -1)
    prior = np.diag([1.0] * len(problem.nuisance) + [0.0])
    best = np.linalg.solve(flat @ flat.T + prior, flat @ (residual * np.sqrt(evidence.weights)[:, None]).ravel())
    left = residual - np.tensordot(best, more, axes=1)
    after = float((evidence.weights[:, None] * left**2).sum() + best[:-1] @ best[:-1])
    gain = evidence.gains(1, torque, [slice(0, 1)])[0] * max(evidence.spread, 1.0)
    assert gain == pytest.approx(before - after, rel=1e-4)


def test_noise_follows_no_basis_function_and_is_no_louder_than_noise() -> None:
    problem, scene = null()
    found = seek(problem, scene.evidence, scene.residual, scene.columns, library(scene.data, range(2)))
    assert found.found == []
    assert scene.excess().max() < 3.0


def test_the_right_basis_function_is_found_among_thousands() -> None:
    problem, scene, evidence, torque = planted(0.2)
    residual = scene.residual + 0.2 * evidence.column(1, torque)[0]
    found = seek(problem, evidence, residual, scene.columns, library(scene.data, range(2))).found
    assert [(one.joint, one.function.effect) for one in found] == [(1, "cogging")]
    assert found[0].function.at == pytest.approx(4.0, abs=0.2)


def test_every_basis_function_can_be_read_and_is_finite() -> None:
    _, scene = null()
    for joint in range(2):
        for function in basis_functions(scene.data, joint):
            assert np.isfinite(function.torque(scene.data, joint)).all(), function.texts


def test_a_table_becomes_one_curve_of_the_same_torque() -> None:
    _, scene = null()
    for function in filter(lambda f: f.table, basis_functions(scene.data, 1)):
        sizes = np.linspace(-1.0, 2.0, len(function.texts))
        (text,), _ = joined(list(function.texts), sizes)
        wanted = np.tensordot(sizes, function.torque(scene.data, 1), axes=1)
        np.testing.assert_allclose(scene.data.torque(read_term(text), 1), wanted, atol=2e-4)


def test_better_is_beyond_doubt_or_not_at_all() -> None:
    rng = np.random.default_rng(0)
    before = rng.standard_normal((30, 40))
    assert confirmed(2.0 * before, before, Confirmed())
    assert not confirmed(before, 2.0 * before, Confirmed())
    assert not confirmed(before, before, Confirmed())


def test_a_basis_function_of_two_inner_numbers_has_neighbours_and_others_have_none() -> None:
    rest = BasisFunction(("friction(rested(0.3, 0.02))",), ("history",), 3)
    texts = {function.texts[0] for function in neighbours(rest, TermLibrary())}
    assert texts == {f"friction(rested({a}))" for a in ("0.9, 0.02", "0.1, 0.02", "0.3, 0.08", "0.3, 0.005")}
    assert neighbours(BasisFunction(("q^3",), ("position",), 2), TermLibrary()) == []


@pytest.mark.parametrize("span", [0.0, 1e-8, 1e-6])
def test_a_joint_that_stands_still_has_no_table_and_every_function_can_be_read(span: float) -> None:
    _, scene = null()
    q = scene.data.q.copy()
    q[..., 0] = 0.0416989 + span * np.linspace(0.0, 1.0, q[..., 0].size).reshape(q.shape[:-1])
    still = replace(scene.data, q=q)
    for j in range(len(still.joints)):
        functions = basis_functions(still, j)
        assert functions
        for function in functions:
            assert np.isfinite([still.torque(read_term(text), j) for text in function.texts]).all()
