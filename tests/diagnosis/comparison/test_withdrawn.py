"""A correction that makes windows worse that took no part in the fit is withdrawn, one that helps stays."""

import numpy as np
import pytest

from bumblebee.diagnosis import diagnose as diagnosis
from bumblebee.diagnosis.comparison.withdrawal import is_worse, standing
from bumblebee.diagnosis.residuals.problem import Problem, make_problem
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.sim.effects import single
from tests.diagnosis import arm

TRUE = single("coulomb_friction", "j2", 1.0)
WRONG = single("coulomb_friction", "j3", 1.0)


@pytest.fixture(scope="module")
def rubbing() -> Problem:
    """Windows of an arm whose second joint has 1 N m of dry friction."""
    rollouts = arm.simulate({("coulomb_friction", "j2"): 1.0}, count=2)
    session = arm.session_of(rollouts)
    windows = cut(session.plant, session.layout, rollouts, choose_starts(rollouts, [0, 1], 0.2, 24))
    rng = np.random.default_rng(0)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)


def test_the_true_effect_stands(rubbing: Problem) -> None:
    assert standing(rubbing, [TRUE], []) == ([TRUE], [], [])


def test_a_wrong_effect_is_withdrawn_with_a_note(rubbing: Problem) -> None:
    fitted, read, notes = standing(rubbing, [WRONG], [])
    assert fitted == read == []
    assert len(notes) == 1
    assert "coulomb_friction on j3" in notes[0]


def test_what_was_read_off_the_logs_falls_alone(rubbing: Problem) -> None:
    coarse = single("encoder_quantisation", "j2", 0.3)
    fitted, read, notes = standing(rubbing, [TRUE], [coarse])
    assert fitted == [TRUE]
    assert read == []
    assert "encoder_quantisation on j2" in notes[0]


def test_the_same_model_is_not_worse(rubbing: Problem) -> None:
    assert not is_worse(rubbing, [TRUE], [TRUE])


def test_structure_is_that_of_the_model_that_stands(monkeypatch) -> None:
    """A withdrawn fit is no longer what `structure` and `settings` describe: the joint that lacks friction is named."""
    monkeypatch.setattr(diagnosis, "standing", lambda problem, fitted, read: ([], [], ["withdrawn: all"]))
    rollouts = arm.simulate({("coulomb_friction", "j2"): 1.0}, count=3, seed=3)
    session = arm.session_of(rollouts)
    document = diagnosis.diagnose(session, arm.SMALL).document
    assert document["effects"] == []
    assert "withdrawn: all" in document["notes"]
    assert document["structure"]["j2"]["significant"]
    assert "j2" in document["unexplained"]["where"]


def test_what_is_worse_on_held_out_rollouts_and_better_at_no_horizon_is_withdrawn(monkeypatch) -> None:
    """Windows of 0.2 s in units of their noise may pass what errs more in radians after 1 s."""
    rollouts = arm.simulate({("coulomb_friction", "j2"): 1.0}, count=3, seed=3)
    session = arm.session_of(rollouts)
    monkeypatch.setattr(diagnosis, "standing", lambda problem, fitted, read: ([WRONG], [], []))
    found = diagnosis.diagnose(session, arm.SMALL)
    assert found.effects == [] and found.document["effects"] == []
    said = "withdrawn, for its error on the held-out rollouts was larger: coulomb_friction on j3; joints after 0.02 s "
    assert any(note.startswith(said) and " after 1.0 s " in note for note in found.document["notes"])
    assert found.document["error"]["after"] == found.document["error"]["before"]


def test_of_two_effects_that_do_harm_together_the_one_goes_without_which_held_out_rollouts_err_least(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The other stays where it is, with an interval of its own; the note says which went and what both together did."""
    rollouts = arm.simulate({("coulomb_friction", "j2"): 1.0, ("viscous_friction", "j1"): 0.3}, count=4, seed=3)
    asked: list[dict] = []

    def harm_together(removed: dict) -> bool:
        asked.append(removed)
        return len(asked) == 1

    monkeypatch.setattr(diagnosis, "harms", harm_together)
    session = arm.session_of(rollouts)
    assert session.holdout
    found = diagnosis.diagnose(session, arm.SMALL)
    assert [(effect.effect, effect.where) for effect in found.effects] == [("coulomb_friction", ("j2",))]
    (entry,) = found.document["effects"]
    assert entry["effect"] == "coulomb_friction" and entry["parameters"]
    said = "withdrawn, for its error on the held-out rollouts was larger: viscous_friction on j1; joints after 0.02 s "
    (note,) = [note for note in found.document["notes"] if note.startswith(said)]
    assert note.endswith("; the rest was chosen by these rollouts: judge it by new ones")
    before, after = (found.document["error"][part]["0.2"]["joint_pos_rmse"]["value"] for part in ("before", "after"))
    assert after < before
    assert len(asked) == 2
