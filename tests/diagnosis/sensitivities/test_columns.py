"""Answers to pulses are simulated again next to what has changed, and taken over elsewhere."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.candidates.signal_scales import scales_of
from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.residuals.problem import Problem, make_problem
from bumblebee.diagnosis.sensitivities import columns as screening
from bumblebee.diagnosis.sensitivities.columns import Answered, pulse_sizes, screen
from bumblebee.diagnosis.sensitivities.impulse_responses import Answers, answers_of
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.sim.effects import Effect, single
from tests.diagnosis import arm

FOUND = [single("viscous_friction", "j3", 0.2)]
KINDS = ("coulomb_friction", "viscous_friction", "armature", "motor_strength")


@pytest.fixture(scope="module")
def made() -> tuple[Session, Problem]:
    """A few windows of the arm."""
    session = make_session(mujoco.MjSpec.from_string(arm.XML), arm.simulate({}, count=2, seconds=3.0), "arm", "memory")
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, 10))
    rng = np.random.default_rng(0)
    return session, make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)


def test_columns_beside_what_was_found_elsewhere_hardly_change(
    made: tuple[Session, Problem], monkeypatch: pytest.MonkeyPatch
) -> None:
    session, problem = made
    every = [c for c in all_candidates(session.plant, session.rollouts, []) if c.effect in KINDS]
    sizes = pulse_sizes(problem, scales_of(session.plant, session.rollouts).torque)
    fresh, white = screen(problem, every, FOUND, sizes)
    known = Answered([], screen(problem, every, [], sizes)[1], (problem.windows, problem.whitener))
    assert known.on(problem) is known
    assert known.on(problem.part(np.arange(5))) is None
    pushed: list[int] = []

    def counted(*args: object, only: np.ndarray, segments: int) -> Answers:
        pushed.extend(only.tolist())
        return answers_of(*args, only=only, segments=segments)

    monkeypatch.setattr(screening, "answers_of", counted)
    again, taken = screen(problem, every, FOUND, sizes, known)
    assert pushed == [1, 2]  # the joint's own and the one that it hangs on
    assert np.array_equal(taken[:, 1:], white[:, 1:])
    assert np.array_equal(taken[:, 0], known.white[:, 0])
    for c, rows in zip(every, fresh.slices, strict=True):
        a, b = fresh.values[rows].ravel().astype(float), again.values[rows].ravel().astype(float)
        assert a @ b > 0.995 * np.linalg.norm(a) * np.linalg.norm(b), (c.effect, c.where)
        assert np.linalg.norm(b) == pytest.approx(np.linalg.norm(a), rel=0.05)


@pytest.mark.parametrize(
    ("before", "now", "near"),
    [
        ([], [], [0, 1, 2]),
        ([], [Effect("command_delay", (), {"delay": 0.01})], [0, 1, 2]),
        (FOUND, [*FOUND, single("link_mass", "l1", 2.0)], [0, 1]),
        (FOUND, [single("viscous_friction", "j3", 0.3)], [1, 2]),
    ],
)
def test_what_is_near(made: tuple[Session, Problem], before: list[Effect], now: list[Effect], near: list[int]) -> None:
    """Everything for an effect on the whole robot, and where nothing has changed: then something else has."""
    assert screening._near(made[1].plant, before, now).tolist() == near


@pytest.mark.parametrize("kind", ["command_filter", "dropped_commands"])
def test_what_makes_commands_later_acts_the_same_way_where_they_are_late_already(
    made: tuple[Session, Problem], kind: str
) -> None:
    session, problem = made
    later = [c for c in all_candidates(session.plant, session.rollouts, []) if (c.effect, c.where) == (kind, "j2")][:1]
    sizes = pulse_sizes(problem, scales_of(session.plant, session.rollouts).torque)
    punctual, late = (
        screen(problem, later, effects, sizes)[0].values[0].ravel().astype(float)
        for effects in ([], [single("command_delay", "j2", 0.015)])
    )
    assert punctual @ late > 0.8 * np.linalg.norm(punctual) * np.linalg.norm(late)
