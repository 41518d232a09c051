"""Rollouts held out by a condition take no part; what is asked for and not there is named."""

from dataclasses import replace
from pathlib import Path

import pytest

from bumblebee.diagnosis.dataset.held_out import read_held_out, split_by, varied
from bumblebee.diagnosis.dataset.informative_split import informative
from bumblebee.diagnosis.dataset.session import hold_out, open_session
from bumblebee.diagnosis.dataset.split import accepting_across
from bumblebee.diagnosis.thresholds.dataset import Split
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import write_rollout
from tests.diagnosis import servo_at_gains as servo
from tests.diagnosis.arm import session_of
from tests.diagnosis.servo_at_gains import Setting

THREE = [Setting(kp=0.4), Setting(kp=1.0), Setting(kp=2.5)]


def test_the_rollouts_of_a_condition_are_held_out_and_some_of_the_others_decide() -> None:
    session = hold_out(session_of(servo.record(THREE, each=4), servo.xml()), read_held_out("kp=0.4, 2.5"))
    assert session.holdout == [0, 1, 2, 3, 8, 9, 10, 11]
    assert session.train == [4, 5, 6, 7]
    assert session.accept and set(session.accept) < set(session.train)
    assert "kp = 0.4, 2.5" in session.notes[0]


def test_what_a_condition_holds_out_stays_out_however_much_it_shows() -> None:
    session = hold_out(session_of(servo.record(THREE, each=3), servo.xml()), read_held_out("kp=2.5"))
    assert informative(session, 0.2).holdout == session.holdout


def test_a_condition_with_too_few_rollouts_left_still_takes_no_part() -> None:
    session = hold_out(session_of(servo.record(THREE, each=1), servo.xml()), read_held_out("kp=0.4,2.5"))
    assert (session.train, session.accept, session.holdout) == ([1], [], [0, 2])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("kp", "NAME=VALUE"),
        ("kp=", "NAME=VALUE"),
        ("=2", "NAME=VALUE"),
        ("kp=1,,2", "NAME=VALUE"),
        ("surface=carpet", "kp"),
        ("kp=0.3", "0.4, 1, 2.5"),
        ("kp=stiff", "0.4, 1, 2.5"),
        ("kp=0.4,1,2.5", "at least one rollout to fit"),
    ],
)
def test_what_cannot_be_held_out_is_said_in_one_line(text: str, says: str) -> None:
    rollouts = servo.record(THREE, each=1, seconds=0.5)
    with pytest.raises(BadInput, match=says) as error:
        split_by(rollouts, read_held_out(text))
    assert "\n" not in str(error.value)


def test_rollouts_to_hold_out_that_were_set_aside_are_named(tmp_path: Path) -> None:
    """A value all of whose rollouts were set aside leaves a note; where no value is left nothing can be held out."""
    for k, rollout in enumerate(servo.record(THREE, each=1)):
        steady = (
            rollout.joint_pos if rollout.meta["kp"] != [2.5] else rollout.joint_pos + 5.0 * (rollout.time > 1)[:, None]
        )
        made = replace(rollout, rollout_id=f"log{k}", joint_pos=steady)
        write_rollout(tmp_path / "set" / "rollouts" / f"log{k}.parquet", made)
    (tmp_path / "model.xml").write_text(servo.xml())
    session = open_session(tmp_path / "model.xml", tmp_path / "set", held_out=read_held_out("kp=0.4,2.5"))
    assert [r.rollout_id for r in session.rollouts] == ["log0", "log1"] and session.holdout == [0]
    assert "to be held out, but set aside: log2 (kp = 2.5)" in session.notes
    with pytest.raises(BadInput, match=r"--hold-out kp: expected rollouts that can be used, came 1 set aside: log2"):
        open_session(tmp_path / "model.xml", tmp_path / "set", held_out=read_held_out("kp=2.5"))


def test_numbers_match_but_for_rounding_and_texts_to_the_letter() -> None:
    held = read_held_out("gain=0.205")
    assert held.matches(0.204966) and not held.matches(0.21) and not held.matches(None)
    assert read_held_out("surface=wet grass").matches("wet grass")
    assert not read_held_out("surface=wet").matches("wet grass")


def test_only_what_is_not_the_same_for_all_is_told() -> None:
    rollouts = servo.record([Setting(), Setting(load=0.2), Setting(load=0.2, supply=0.9)], each=1, seconds=0.5)
    told = varied(rollouts)
    assert set(told) == {"added_mass", "supply_voltage"}
    assert told["added_mass"] == [
        {"value": 0.2, "rollouts": ["r01", "r02"]},
        {"value": None, "rollouts": ["r00"]},
    ]


def test_acceptance_is_decided_by_several_motions_and_conditions() -> None:
    motions, gains = [m for m in "abcd" for _ in (0, 1)], [1, 4] * 4
    accept = accepting_across(motions, gains, Split())
    assert len(accept) == 2
    assert len({motions[i] for i in accept}) == len({gains[i] for i in accept}) == 2
    assert accepting_across(["a"], [1], Split()) == []
    repeats = accepting_across(["a", "a", "b", "b"], [1, 1, 1, 1], Split())
    assert len({motions[i] for i in repeats}) == 1  # both repeats are on one side
