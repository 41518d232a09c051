"""Notes of the checks that say one thing of many recordings are one line."""

from bumblebee.diagnosis.dataset.told_once import told_once

LINE = (
    "log{0}.parquet: column joint_pos[{1}], row {2}: rule frozen: expected a reading that follows, came {2} equal rows"
)


def test_lines_that_differ_by_recording_joint_and_numbers_are_one_with_a_count() -> None:
    lines = [LINE.format(k, joint, 40 + k) for k in range(6) for joint in ("hip", "knee", "ankle")]
    assert told_once(lines) == [f"{lines[0]} (18 alike in 6 recordings)"]
    assert told_once(lines[:3]) == [f"{lines[0]} (3 alike in this recording)"]


def test_lines_of_other_columns_and_rules_and_lines_without_either_stay() -> None:
    first = LINE.format(0, "hip", 40)
    other = [first.replace("joint_pos", "joint_vel"), first.replace("frozen", "range"), "no place", "no place at all"]
    assert told_once([first, *other]) == [first, *other]
