"""The printed errors judge, too: a correction that held-out rollouts surely refute is withdrawn, with a note."""

from types import SimpleNamespace

import pytest

from bumblebee.diagnosis import diagnose as diagnosis
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.report import held_out_errors
from bumblebee.diagnosis.report.held_out_errors import refuted, surely_better, unrefuted
from bumblebee.diagnosis.thresholds.report import Refuted
from bumblebee.sim.effects import single
from tests.diagnosis import arm

RULE = Refuted()
TRUE = single("coulomb_friction", "j2", 1.0)
WRONG = single("coulomb_friction", "j3", 1.0)


def entry(after: float, share: float | None, *ends: float) -> dict:
    return {"before": 1.0, "after": after, "floor": 0.9 if share is None else 0.2, "share": share, "ci95": ends or None}


MAYBE, WORSE = entry(0.95, 0.3, -0.6, 1.0), entry(1.15, -0.17, -0.22, -0.09)
GONE, NOISE, SLIGHTLY = entry(0.3, 0.9, 0.7, 1.0), entry(0.99, None), entry(1.01, -0.01, -0.02, -0.005)


@pytest.mark.parametrize(
    ("by_horizon", "better", "worse"),
    [
        ({"0.02": [MAYBE, NOISE], "0.2": [WORSE, NOISE]}, [], ["0.2"]),
        ({"0.02": [GONE], "0.2": [WORSE]}, ["0.02"], []),
        ({"0.02": [MAYBE], "0.2": [entry(1.1, -0.1, -0.9, 0.1)]}, [], []),
        ({"0.2": [SLIGHTLY]}, [], []),
        ({"0.2": [NOISE]}, [], []),
        ({"0.2": [entry(4.0, None)]}, [], ["0.2"]),
        ({"0.2": [GONE, WORSE]}, [], ["0.2"]),
    ],
)
def test_surely_worse_at_one_horizon_and_better_at_none_is_refuted(by_horizon: dict, better: list, worse: list) -> None:
    errors, held = SimpleNamespace(removed=by_horizon), SimpleNamespace(holdout=[1])
    assert surely_better(by_horizon, RULE) == better
    assert refuted(held, errors, RULE) == worse
    assert refuted(SimpleNamespace(holdout=[]), errors, RULE) == []


@pytest.fixture(scope="module")
def rubbing() -> Session:
    """An arm whose second joint has 1 N m of dry friction."""
    return arm.session_of(arm.simulate({("coulomb_friction", "j2"): 1.0}, count=4, seed=3))


def test_the_true_effect_stands_and_a_wrong_one_falls_with_what_it_is_called(rubbing: Session) -> None:
    assert unrefuted(rubbing, [TRUE], [], arm.SMALL)[0] == [TRUE]
    fitted, read, errors, notes = unrefuted(rubbing, [WRONG], [], arm.SMALL)
    assert fitted == read == []
    assert errors.block["before"] == errors.block["after"]
    assert "coulomb_friction on j3" in notes[0] and "held-out rollouts was larger after" in notes[0]


def test_what_was_read_off_the_logs_is_judged_again_alone(rubbing: Session) -> None:
    fine = single("encoder_quantisation", "j2", 1e-5)
    assert unrefuted(rubbing, [WRONG], [fine], arm.SMALL)[:2] == ([], [fine])


def test_the_document_of_what_is_withdrawn_is_that_of_the_declared_model(rubbing: Session, monkeypatch) -> None:
    def always(session, errors, rule):
        return ["0.2"] if errors.block["before"] != errors.block["after"] else []

    monkeypatch.setattr(held_out_errors, "refuted", always)
    made = diagnosis.diagnose(rubbing, arm.SMALL)
    assert made.effects == made.document["effects"] == made.document["summary"]["trust"] == []
    assert made.document["error"]["after"] == made.document["error"]["before"]
    assert any("withdrawn" in note and "coulomb_friction on j2" in note for note in made.document["notes"])
    assert "j2" in made.document["unexplained"]["where"]
