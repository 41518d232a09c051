"""An effect is worth what the rollouts of the first sentence lose without it; page and terminal say so in words."""

from dataclasses import replace

import pytest

from bumblebee.diagnosis.report.left_out import shares_left_out, shares_words
from bumblebee.diagnosis.report.page import render_report
from bumblebee.diagnosis.report.terminal import summary
from bumblebee.sim.effects import Effect
from tests.diagnosis import cart
from tests.diagnosis.report.test_what_matters import document

FRICTION = Effect("coulomb_friction", ("cart",), {"frictionloss": 3.0})
SPRING = Effect("joint_spring", ("pole",), {"stiffness": 0.0, "preload": 0.0})


@pytest.fixture(scope="module")
def both():
    """Two rollouts with friction that the declared model lacks, two without."""
    rollouts = [
        replace(one, rollout_id=f"{name}-{one.rollout_id}")
        for name, size in (("with", 3.0), ("without", 0.0))
        for one in cart.record(count=2, friction=(size, 0.0))
    ]
    return cart.session(rollouts)


def held_out(session, name: str):
    return replace(session, holdout=[i for i, r in enumerate(session.rollouts) if r.rollout_id.startswith(f"{name}-")])


def test_an_effect_is_worth_what_the_held_out_rollouts_lose_without_it_whatever_others_say(both) -> None:
    (lost,) = shares_left_out(held_out(both, "with"), 20, [FRICTION], [[]])
    assert lost == 1.0
    assert shares_left_out(held_out(both, "without"), 20, [FRICTION], [[]]) == [None]  # worse: there is no share


def test_two_halves_of_one_effect_are_each_worth_less_than_half_and_the_words_say_why(both) -> None:
    half = replace(FRICTION, parameters={"frictionloss": 1.5})
    more = Effect("asymmetric_friction", ("cart",), {"difference": 0.0})
    shares = shares_left_out(held_out(both, "with"), 20, [FRICTION, more], [[half, more], [FRICTION]])
    assert 0.1 < shares[0] < 0.5 and shares[1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("shares", "said"),
    [
        ((0.2, 0.1), "The shares sum to 30 %: the other 70 % is lost only with several of them"),
        ((1.0, 0.4), "The shares sum to 140 %: some effects need each other"),
        ((0.0, 0.0), "The shares sum to 0 %: the other 100 % is lost only with several"),
        ((0.9, 0.1), "comes back when this one alone is left out."),
        ((None, None), "Together the effects take nothing off the squared error after 0.2 s on the held-out rollouts"),
    ],
)
def test_page_and_terminal_say_what_the_shares_are_of_and_what_they_sum_to(shares: tuple, said: str) -> None:
    made = document()
    made["effects"] = [e | {"explains": share} for e, share in zip(made["effects"], shares, strict=False)]
    made["summary"]["trust"] = made["summary"]["trust"][:2]
    words = shares_words(made)
    assert said in words and ("sum" in words) is ("sum" in said)
    assert words in render_report(made, []) and words in summary(made)
    assert "lost without it: " + ("-" if None in shares else f"{100 * shares[0]:.0f} %") in summary(made)
