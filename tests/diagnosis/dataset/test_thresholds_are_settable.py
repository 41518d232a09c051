"""A configuration decides in every room, from the reading of the logs to the columns of the candidates."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates import is_simulated
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import make_session
from bumblebee.diagnosis.prepare import Material, gather
from bumblebee.diagnosis.sensitivities import pulse_sizes, screen
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.diagnosis.thresholds.candidates import CandidateLimits, CandidateThresholds, DriveSteps
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds, Extent, Split, TimeSteps, Usable
from bumblebee.diagnosis.thresholds.residuals import ResidualThresholds, Whitening
from bumblebee.diagnosis.thresholds.sensitivities import Impulses, SensitivityThresholds
from bumblebee.diagnosis.thresholds.simulation import SimulationThresholds, Solver, Windowing
from bumblebee.errors import BadInput
from tests.diagnosis import arm

OTHER = Thresholds(
    simulation=SimulationThresholds(windows=Windowing(outputs=3), solver=Solver(iterations=123)),
    dataset=DatasetThresholds(
        split=Split(every=2), time_steps=TimeSteps(coarse=0.002), extent=Extent(more=1.0, long_window=0.5)
    ),
    candidates=CandidateThresholds(drive=DriveSteps(time=0.003, limit=(0.5,)), limits=CandidateLimits(few_joints=0)),
    residuals=ResidualThresholds(whitening=Whitening(curved=5.0)),
    sensitivities=SensitivityThresholds(impulses=Impulses(segments=2, torque=0.05)),
)


def _material(thresholds: Thresholds) -> Material:
    rollouts = arm.simulate({}, count=4, seconds=2.0)
    config = DiagnosisConfig(max_windows=8, max_holdout_windows=4, max_long_windows=2, thresholds=thresholds)
    spec = mujoco.MjSpec.from_string(arm.XML)
    session = make_session(spec, rollouts, "arm", "memory", thresholds=thresholds.dataset)
    return gather(session, config, np.random.default_rng(0), lambda text: None)


@pytest.fixture(scope="module")
def both() -> tuple[Material, Material]:
    """By the usual thresholds and by others."""
    return _material(Thresholds()), _material(OTHER)


def test_of_the_dataset(both: tuple[Material, Material]) -> None:
    """Rollouts held out, steps of the sensitivities, numbers and lengths of windows."""
    usual, other = both
    assert [len(m.session.holdout) for m in both] == [1, 2]
    assert usual.problem.coarse > other.problem.coarse == pytest.approx(0.002)
    assert len(usual.problem.windows) > len(other.problem.windows) == 8
    assert [m.holdout.long.span for m in both] == pytest.approx([1.0, 0.5])


def test_of_the_simulation(both: tuple[Material, Material]) -> None:
    """Compared ticks of a window; the solver's iterations, for which the model is made again."""
    usual, other = both
    assert [m.problem.windows.out_time.shape[1] for m in both] == [6, 3]
    assert usual.problem.plant.model.opt.iterations != other.problem.plant.model.opt.iterations == 123


def test_of_the_candidates(both: tuple[Material, Material]) -> None:
    """First steps, how many are tried, which are simulated."""
    lags = [next(c for c in m.candidates if (c.effect, c.where) == ("torque_lag", "j2")) for m in both]
    assert [lag.step for lag in lags] == [(0.005,), (0.003,)]
    assert [is_simulated(lag, 3) for lag in lags] == [True, False]
    tried = [sum((c.effect, c.where) == ("torque_limit", "j2") for c in m.candidates) for m in both]
    assert tried[0] > tried[1] == 1
    remade = [m.remade([])[0] for m in both]
    assert [len(new) for new in remade] == [len(m.candidates) for m in both]


def test_of_the_residuals(both: tuple[Material, Material]) -> None:
    """More of what is not linear in the starts is taken for noise: the same residual counts less."""
    other = _material(Thresholds(residuals=OTHER.residuals))
    power = [(m.problem.residual([[]]) ** 2).mean() for m in (both[0], other)]
    assert power[1] < power[0]


def test_of_the_sensitivities(both: tuple[Material, Material]) -> None:
    """Size and number of the impulses."""
    sizes = [pulse_sizes(m.problem, m.typical) for m in both]
    assert sizes[1] == pytest.approx(0.5 * sizes[0], rel=0.2)
    friction = [c for c in both[0].candidates if c.effect == "coulomb_friction"]
    answers = [screen(m.problem, friction, [], size)[1] for m, size in zip(both, sizes, strict=True)]
    assert [a.shape[2] for a in answers] == [5, 2]


def test_a_rollout_is_long_enough_by_what_is_set() -> None:
    rules = DatasetThresholds(usable=Usable(seconds=60.0))
    with pytest.raises(BadInput, match=r"at least 60\.0 s"):
        make_session(mujoco.MjSpec.from_string(arm.XML), arm.simulate({}, count=1), "arm", "memory", thresholds=rules)
