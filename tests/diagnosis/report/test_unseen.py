"""Effects that only an unfitted rollout shows are noted."""

from bumblebee.diagnosis.report.notes import unseen_notes
from bumblebee.sim.effects import single
from tests.diagnosis.dataset.test_informative_split import LIMIT, _four, _mixed, _session


def test_a_limit_that_only_a_rollout_put_aside_meets_is_noted() -> None:
    (aside,) = _session(_four(False)).holdout
    session = _session(_mixed(aside))
    (note,) = unseen_notes(session, [], 0.2)
    assert note.startswith(f"{session.rollouts[aside].rollout_id}: ")


def test_nothing_is_noted_where_all_are_alike_or_the_model_has_it() -> None:
    assert unseen_notes(_session(_four(False)), [], 0.2) == []
    assert unseen_notes(_session(_four(True)), [], 0.2) == []
    (aside,) = _session(_four(False)).holdout
    assert unseen_notes(_session(_mixed(aside)), [single("torque_limit", "j2", LIMIT)], 0.2) == []
