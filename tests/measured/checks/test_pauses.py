"""A recording with a pause becomes its parts; none of its rows is lost but those of parts that are too short."""

from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.dataset import open_session
from bumblebee.measured.pauses import cut_at_pauses
from bumblebee.measured.rollout import Rollout, write_rollout
from tests.diagnosis import cart


def with_pauses(rollout: Rollout, *rows: int, periods: float = 8.0) -> Rollout:
    """The rollout with `periods` missing before each of `rows`."""
    late = sum((np.arange(rollout.frames) >= row) * periods / rollout.control_hz for row in rows)
    return replace(rollout, time=rollout.time + late)


def test_a_pause_makes_two_rollouts_of_one_and_keeps_every_row() -> None:
    (whole,) = cart.record(count=1)
    first, second = cut_at_pauses(with_pauses(whole, 120))
    assert (first.rollout_id, second.rollout_id) == (f"{whole.rollout_id}_1", f"{whole.rollout_id}_2")
    assert first.frames == 120 and first.frames + second.frames == whole.frames
    np.testing.assert_array_equal(np.concatenate((first.joint_pos, second.joint_pos)), whole.joint_pos)
    brief = with_pauses(whole, 120, periods=3)
    assert cut_at_pauses(whole) == [whole] and cut_at_pauses(brief) == [brief]


def test_parts_of_less_than_a_second_are_left_out_and_a_log_of_such_parts_stays_whole() -> None:
    (whole,) = cart.record(count=1)
    (only,) = cut_at_pauses(with_pauses(whole, 20))
    assert only.frames == whole.frames - 20
    shredded = with_pauses(whole, *range(0, whole.frames, 30))
    assert cut_at_pauses(shredded) == [shredded]


def test_a_diagnosis_uses_both_parts_and_says_so_once(tmp_path) -> None:
    rollouts = cart.record(count=3)
    for rollout in (with_pauses(rollouts[0], 100), with_pauses(rollouts[1], 120), rollouts[2]):
        write_rollout(tmp_path / "set" / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
    (tmp_path / "model.xml").write_text(cart.xml())
    session = open_session(tmp_path / "model.xml", tmp_path / "set")
    assert len(session.rollouts) == 5 and session.set_aside == []
    (note,) = [note for note in session.notes if note.startswith("cut at pauses of more than 5 periods")]
    assert f"{rollouts[0].rollout_id} into {rollouts[0].rollout_id}_1, {rollouts[0].rollout_id}_2" in note
