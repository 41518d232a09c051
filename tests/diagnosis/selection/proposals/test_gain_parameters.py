"""Two effects on one servo's gains are written as one where one does."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import make_problem, window_weights
from bumblebee.diagnosis.selection.proposals.gain_parameters import plain_gains
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm


@pytest.mark.parametrize(
    ("truth", "start", "wanted", "value"),
    [
        # Viscous friction of 2 beside a kd of 4 is a kd of 6.
        (("viscous_friction", 2.0), {"motor_strength": 1.5, "kp": 1 / 1.5}, "kd", 1.5),
        (("motor_strength", 0.6), {"kp": 0.6, "kd": 0.6}, "motor_strength", 0.6),
    ],
)
def test_a_pair_becomes_one(truth: tuple[str, float], start: dict[str, float], wanted: str, value: float) -> None:
    rollouts = arm.simulate({(truth[0], "j2"): truth[1]}, count=1)
    session = arm.session_of(rollouts)
    windows = cut(session.plant, session.layout, rollouts, choose_starts(rollouts, [0], 0.2, 14))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    candidates = all_candidates(session.plant, rollouts, [])
    chosen = [c for kind in start for c in candidates if (c.effect, c.where) == (kind, "j2")]
    weights = window_weights(problem.residual([[]])[0])
    pair = gauss_newton(problem, chosen, list(start.values()), weights)
    one = plain_gains(problem, pair, candidates, weights, bound=4.0)
    assert [c.effect for c in one.chosen] == [wanted]
    assert one.values[0] == pytest.approx(value, rel=0.01)


@pytest.mark.parametrize(("damping", "wanted"), [(0.4, ["kp"]), (1.5, ["motor_strength", "viscous_friction"])])
def test_a_weaker_drive_whose_damping_is_made_up_for_is_a_lower_kp(damping: float, wanted: list[str]) -> None:
    """A strength of 0.9 takes 0.4 of a kd of 4 away."""
    rollouts = arm.simulate({("motor_strength", "j2"): 0.9, ("viscous_friction", "j2"): damping}, count=1)
    session = arm.session_of(rollouts)
    windows = cut(session.plant, session.layout, rollouts, choose_starts(rollouts, [0], 0.2, 14))
    problem = make_problem(
        session.plant, session.layout, windows, session.sigma, session.steps, [], np.random.default_rng(0)
    )
    candidates = all_candidates(session.plant, rollouts, [])
    kinds = ("motor_strength", "viscous_friction")
    chosen = [c for kind in kinds for c in candidates if (c.effect, c.where) == (kind, "j2")]
    weights = window_weights(problem.residual([[]])[0])
    pair = gauss_newton(problem, chosen, [0.9, chosen[1].nominal[0] + damping], weights)
    plain = plain_gains(problem, pair, candidates, weights, bound=4.0)
    assert [c.effect for c in plain.chosen] == wanted
    assert plain.values[0] == pytest.approx(0.9, rel=0.02)


def test_what_needs_both_keeps_both() -> None:
    rollouts = arm.simulate({("motor_strength", "j2"): 0.6, ("viscous_friction", "j2"): 2.0}, count=1)
    session = arm.session_of(rollouts)
    windows = cut(session.plant, session.layout, rollouts, choose_starts(rollouts, [0], 0.2, 14))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    candidates = all_candidates(session.plant, rollouts, [])
    chosen = [c for kind in ("kp", "motor_strength") for c in candidates if (c.effect, c.where) == (kind, "j2")]
    weights = window_weights(problem.residual([[]])[0])
    pair = gauss_newton(problem, chosen, [0.55, 1.1], weights)
    both = plain_gains(problem, pair, candidates, weights, bound=4.0)
    factors = {c.effect: float(both.of(c)[0]) for c in both.chosen}
    assert factors == pytest.approx({"kp": 0.6, "kd": 1.1}, rel=0.02)  # kd 0.6 * 4 + 2 of 4
