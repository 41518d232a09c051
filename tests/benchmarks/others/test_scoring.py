"""Weights, the control period, the curriculum and the lowest reward."""

from dataclasses import replace

import pytest
import torch

from benchmarks.baselines.others.scoring import Curriculum, Score, Scoring
from tests.benchmarks.others.steps import judged

DT = 0.02
NEVER = lambda state, ref: torch.zeros(len(state.root_pos_w), dtype=torch.bool)  # noqa: E731


def one(j) -> torch.Tensor:
    return torch.ones(1)


def test_the_sum_is_weighted_and_times_the_control_period():
    scoring = Scoring({"good": one, "bad": one}, {"good": 3.0, "bad": -1.0})
    assert Score(scoring, DT, torch.ones(1, dtype=torch.long), NEVER)(judged().step).item() == pytest.approx(2 * DT)


def test_a_step_is_worth_no_less_than_the_lowest():
    scoring = Scoring({"bad": one}, {"bad": -100.0}, lowest=-0.5)
    assert Score(scoring, DT, torch.ones(1, dtype=torch.long), NEVER)(judged().step).item() == -0.5


def test_rows_and_weights_must_match():
    with pytest.raises(ValueError, match="other"):
        Scoring({"good": one}, {"other": 1.0})


def run(lengths: list[int], curriculum: Curriculum) -> Score:
    """Episodes of these lengths, one after the other, of one world."""
    counter = torch.zeros(1, dtype=torch.long)
    score = Score(Scoring({"bad": one}, {"bad": -1.0}, curriculum), DT, counter, NEVER)
    for length in [*lengths, 1]:
        for frame in range(1, length + 1):
            counter.fill_(frame)
            score(judged().step)
    return score


def test_the_mean_length_follows_the_episodes_that_ended():
    score = run([5, 7], Curriculum())
    wanted = 5 / 10_000 + (7 - 5 / 10_000) / 10_000
    assert score.mean_length.item() == pytest.approx(wanted, rel=1e-5)


def test_punishments_shrink_while_episodes_are_short_and_grow_while_they_are_long():
    settings = Curriculum(start=0.5, least=0.1, degree=0.01, rows=("bad",))
    shrunk = run([10], settings)  # 11 steps with a mean below 50
    assert shrunk.factor.item() == pytest.approx(0.5 * 0.99**11, rel=1e-4)
    grown = run([10], replace(settings, short=-1.0, long=-1.0))
    assert grown.factor.item() == pytest.approx(0.5 * 1.01**11, rel=1e-4)
    assert grown(judged().step).item() == pytest.approx(-DT * grown.factor.item(), rel=1e-5)


def test_the_factor_stays_in_its_range():
    settings = Curriculum(start=0.5, least=0.45, degree=0.1, rows=("bad",))
    assert run([30], settings).factor.item() == pytest.approx(0.45)
    assert run([30], replace(settings, short=-1.0, long=-1.0)).factor.item() == 1.0


def test_a_row_that_the_curriculum_does_not_name_keeps_its_weight():
    counter = torch.ones(1, dtype=torch.long)
    scoring = Scoring({"bad": one}, {"bad": -1.0}, Curriculum(start=0.5))
    assert Score(scoring, DT, counter, NEVER)(judged().step).item() == pytest.approx(-DT)


def test_what_is_lost_is_asked_of_state_and_reference():
    scoring = Scoring({"lost": lambda j: j.lost.float()}, {"lost": -1.0})
    low = lambda state, ref: state.root_pos_w[:, 2] < 1.0  # noqa: E731
    assert Score(scoring, DT, torch.ones(1, dtype=torch.long), low)(judged().step).item() == pytest.approx(-DT)
