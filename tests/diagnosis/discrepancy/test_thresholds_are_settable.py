"""Discrepancies are decided by what is set in `Thresholds`, in each of the room's files."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.formula import formula
from bumblebee.diagnosis.candidates.signal_scales import scales_of
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.submodel import refitted
from bumblebee.diagnosis.dataset.session import Session
from bumblebee.diagnosis.discrepancy.catalogue_alternative import Offers, catalogue_swap
from bumblebee.diagnosis.discrepancy.discover import Discovery, discover
from bumblebee.diagnosis.discrepancy.form import refitted_model
from bumblebee.diagnosis.discrepancy.missing_torque import Scene, fitted_scene
from bumblebee.diagnosis.discrepancy.residual_tests import JointActivity, in_whole
from bumblebee.diagnosis.discrepancy.single_law import single_functions
from bumblebee.diagnosis.discrepancy.stepwise_regression import Found, library, seek
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.diagnosis.thresholds import discrepancy as of
from bumblebee.sim.effects import read_term
from tests.diagnosis.discrepancy.test_discover import prepared

_made: list[tuple[Session, Problem, Problem]] = []


def with_thresholds(**concepts: object) -> tuple[Problem, Problem, np.ndarray]:
    """Fitted windows and validation set of a pole on a cubic spring with thresholds of the room; typical torques."""
    if not _made:
        _made.append(prepared(cubic=0.6))
    session, problem, validation = _made[0]
    thresholds = Thresholds(discrepancy=of.DiscrepancyThresholds(**concepts))
    typical = scales_of(session.plant, session.rollouts).torque
    return replace(problem, thresholds=thresholds), replace(validation, thresholds=thresholds), typical


def empty(problem: Problem) -> Fit:
    return gauss_newton(problem, (), (), np.ones(len(problem.windows)))


def scene_with(**concepts: object) -> Scene:
    problem, _, typical = with_thresholds(**concepts)
    return fitted_scene(problem, empty(problem), typical)


def sought(scene: Scene) -> list[Found]:
    return seek(scene.problem, scene.evidence, scene.residual, scene.columns, library(scene.data, [1])).found


def discovered(**concepts: object) -> Discovery:
    """As in test_discover, where a cubic spring is found with the thresholds as they are."""
    problem, validation, typical = with_thresholds(**concepts)
    return discover(problem, Holdout(validation), empty(problem), JointActivity(typical))


def test_torque_scores_share_of_visible_directions() -> None:
    count = scene_with().evidence.chi_square(1)[1]
    assert scene_with(torque_scores=of.TorqueScores(visible=1.0)).evidence.chi_square(1)[1] < count


def test_regressors_creep() -> None:
    friction = [
        scene_with(regressors=of.Regressors(creep=c)).data.torque(read_term("friction(1)"), 1) for c in (0.02, 50.0)
    ]
    assert np.abs(friction[0]).mean() > 5 * np.abs(friction[1]).mean()


def test_term_library_grids() -> None:
    none = of.TermLibrary(cogging_harmonics=(), least_target_steps=250.0, fastest_beat=0.0)
    assert library(scene_with(term_library=none).data, [1]).count < library(scene_with().data, [1]).count


@pytest.mark.parametrize("rule", [{"level": 1e-300}, {"most": 0}, {"least_share": 1.1}])
def test_stepwise_regression_level_number_and_share(rule: dict[str, float]) -> None:
    assert sought(scene_with())
    assert not sought(scene_with(stepwise_regression=of.StepwiseRegression(**rule)))


def test_residual_tests_standard_errors_of_the_whole() -> None:
    assert not in_whole(scene_with(), None).significant
    assert in_whole(scene_with(residual_tests=of.ResidualTests(whole_alone=2.5)), None).significant


def test_residual_tests_least_torques_decide_whether_a_joint_is_looked_at() -> None:
    large = of.ResidualTests(least_torque=1e3, slight_torque=1e3, whole_alone=np.inf, whole_both=np.inf)
    assert discovered(residual_tests=large).fit.chosen == ()


def test_discover_number_of_joints() -> None:
    assert discovered(discover=of.Discover(joints=0)).fit.chosen == ()


def test_form_number_of_basis_functions() -> None:
    assert discovered(form=of.Form(functions=0)).fit.chosen == ()


def test_catalogue_terms_stiffness_beyond_which_a_term_on_the_target_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []
    monkeypatch.setattr(
        "bumblebee.diagnosis.discrepancy.form.stiffer_than_the_drive", lambda *a: asked.append(a[-1].stiff) or True
    )
    scene = scene_with(catalogue_terms=of.CatalogueTerms(stiff=0.5))
    assert refitted_model(scene.problem, empty(scene.problem), "pole", sought(scene)[:1]) is None
    assert asked == [0.5]


def test_single_law_share_of_the_effects_gain() -> None:
    spring = Candidate("joint_spring", "pole", (0.0, 0.0), (0.1, 0.02), (0, 1))
    found = []
    for near in (0.9, np.inf):
        problem, _, typical = with_thresholds(single_law=of.SingleLaw(near=near))
        fit = refitted(problem, (spring,), np.array([0.1, 0.0]))
        scene = fitted_scene(problem, fit, typical)
        found.append(list(single_functions(problem, fit, scene, library(scene.data, [1]), "pole")))
    assert found[0] and not found[1]


def test_catalogue_alternative_rounds_and_share_that_may_lack() -> None:
    spring = Candidate("joint_spring", "pole", (0.0, 0.0), (0.1, 0.02), (0, 1))
    taken = {}
    for name, rule in {
        "lenient": of.CatalogueAlternative(lacking=np.inf),
        "as it is": of.CatalogueAlternative(),
        "none": of.CatalogueAlternative(lacking=np.inf, rounds=0),
    }.items():
        problem, validation, _ = with_thresholds(catalogue_alternative=rule)
        model = refitted(problem, (formula("pole", {"q^3": -0.6, "q": 0.01}),), np.array([-0.6, 0.01]))
        taken[name] = catalogue_swap(problem, Holdout(validation), empty(problem), model, "pole", Offers([spring]))
    assert taken["lenient"] is not None and taken["as it is"] is None and taken["none"] is None
