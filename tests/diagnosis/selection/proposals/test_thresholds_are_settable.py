"""A proposal decides by what the diagnosis was given, not by what the product comes with."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.prepare import gather
from bumblebee.diagnosis.residuals.problem import Problem, make_problem
from bumblebee.diagnosis.selection.proposals.backlash import backlash_trials
from bumblebee.diagnosis.selection.proposals.drive_grid import drive_trials
from bumblebee.diagnosis.selection.proposals.encoder_resolution import grids
from bumblebee.diagnosis.selection.proposals.joint_elasticity import is_of_series, series
from bumblebee.diagnosis.selection.proposals.joint_misfit import odd_joints
from bumblebee.diagnosis.selection.proposals.packet_loss import loss_likelihoods
from bumblebee.diagnosis.selection.proposals.saturation import _own_off
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.diagnosis.thresholds.proposals import (
    Backlash,
    DriveGrid,
    EncoderResolution,
    JointElasticity,
    JointMisfit,
    PacketLoss,
    ProposalThresholds,
    Saturation,
)
from bumblebee.diagnosis.thresholds.selection import SelectionThresholds
from tests.diagnosis import arm
from tests.diagnosis.selection.begun import answered, state

WINDOWS, OFF = 8, 3


@pytest.fixture(scope="module")
def session() -> Session:
    """The arm, one of its motors at half its strength."""
    rollouts = arm.simulate({("motor_strength", "j2"): 0.5}, count=2, seconds=2.0)
    return make_session(mujoco.MjSpec.from_string(arm.XML), rollouts, "arm", "memory")


def _of(proposals: ProposalThresholds) -> Thresholds:
    return Thresholds(selection=SelectionThresholds(proposals=proposals))


def _problem(session: Session, proposals: ProposalThresholds) -> Problem:
    starts = choose_starts(session.rollouts, [0, 1], 0.2, WINDOWS)
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    rng = np.random.default_rng(0)
    rules = _of(proposals)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng, thresholds=rules)


def _one_joint_off(problem: Problem) -> np.ndarray:
    """Whitened residual (W, M): less than noise, and twelve times the noise on one joint at one tick of one window."""
    noise = 0.7 * np.random.default_rng(1).standard_normal(problem.nuisance.shape[1:])
    raw = np.zeros((len(noise), problem.windows.measured.shape[1], problem.layout.size))
    raw[OFF, 3, 1] = 12 * problem.sigma[1]
    return noise + problem.whitener(raw, centre=False)


def test_a_configuration_reaches_the_problem(session: Session) -> None:
    rules = _of(ProposalThresholds(saturation=Saturation(odd_power=7.0)))
    config = replace(arm.SMALL, max_windows=WINDOWS, max_holdout_windows=WINDOWS, thresholds=rules)
    assert isinstance(config, DiagnosisConfig)
    material = gather(session, config, np.random.default_rng(0), lambda text: None)
    assert material.problem.thresholds.selection.proposals.saturation.odd_power == 7.0


def test_a_joint_is_odd_by_the_chance_that_is_set(session: Session) -> None:
    strict = _problem(session, ProposalThresholds(joint_misfit=JointMisfit(chance=0.0)))
    few = _problem(session, ProposalThresholds(joint_misfit=JointMisfit(windows=2)))
    clean = _one_joint_off(few)
    ((name, odd),) = odd_joints(few, clean)
    assert (name, len(odd)) == ("j2", 2) and OFF in odd
    assert odd_joints(strict, clean) == []


def test_a_joints_own_readings_are_off_by_the_chance_that_is_set(session: Session) -> None:
    usual = _problem(session, ProposalThresholds())
    strict = _problem(session, ProposalThresholds(saturation=Saturation(noise_chance=1e-300)))
    clean, odd = _one_joint_off(usual), np.arange(WINDOWS) == OFF
    assert _own_off(usual, clean, odd, 1.0)[OFF, 1]
    assert not _own_off(strict, clean, odd, 1.0).any()


def test_gains_are_tried_at_the_factors_that_are_set(session: Session) -> None:
    candidates = [c for c in all_candidates(session.plant, session.rollouts, []) if c.where == "j2"]
    found = {}
    for factors in ((0.6,), (1.7,)):
        problem = _problem(
            session, ProposalThresholds(drive_grid=DriveGrid(factors=factors, limits=(2.0,), halvings=0))
        )
        fit, weights = gauss_newton(problem, (), (), np.ones(WINDOWS)), np.ones(WINDOWS)
        found[factors] = [float(t.values[0]) for t in drive_trials(problem, fit, candidates, weights, 0.0)]
    assert found[0.6,] and set(found[0.6,]) == {0.6}
    assert found[1.7,] == []


def test_backlash_is_not_tried_above_the_power_that_is_set(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr("bumblebee.diagnosis.selection.proposals.backlash.odd_joints", lambda *_: asked.append(1) or [])
    for most in (0.0, np.inf):
        problem = _problem(session, ProposalThresholds(backlash=Backlash(most_usual_power=most)))
        fit = gauss_newton(problem, (), (), np.ones(WINDOWS))
        assert answered(backlash_trials(state(problem, fit, [], np.ones(WINDOWS)))) == ([], [])
        assert len(asked) == (most > 0)


def test_runs_of_lost_commands_are_as_long_as_is_set(session: Session) -> None:
    """With one at most, a second loss in a row is like the first; with two it has an effect of its own."""
    logs = {}
    for longest in (1, 2):
        problem = _problem(session, ProposalThresholds(packet_loss=PacketLoss(longest=longest)))
        losses = loss_likelihoods(problem, [], _one_joint_off(problem), "j2")
        logs[longest] = losses.logs
    single = losses.patterns.sum(axis=1) <= 1
    assert np.allclose(logs[1][:, single], logs[2][:, single], rtol=1e-4, atol=1e-4)
    assert not np.allclose(logs[1], logs[2], rtol=1e-4, atol=1e-4)


def test_stiffnesses_are_those_that_are_set(session: Session) -> None:
    tried = series(False, JointElasticity(stiffest=50.0, softest=(5.0, 5.0)))
    assert (tried[0], tried[-1]) == pytest.approx((50.0, 5.0))
    elastic = next(c for c in all_candidates(session.plant, session.rollouts, []) if c.effect == "series_elasticity")
    values = elastic.start * 3 * elastic.step[0] / elastic.start[0] / JointElasticity().step
    for near, is_near in ((2.0, False), (4.0, True)):
        rule = JointElasticity(near=near)
        assert is_of_series(_problem(session, ProposalThresholds(joint_elasticity=rule)), elastic, values) == is_near


def test_encoder_steps_are_sought_from_the_size_that_is_set(session: Session) -> None:
    steps = [replace(r, joint_pos=np.round(r.joint_pos / 0.02) * 0.02) for r in session.rollouts]
    assert [g.step for g in grids(steps)] == [pytest.approx(0.02, rel=0.01)] * 3
    assert grids(steps, rule=EncoderResolution(smallest=0.04)) == []
