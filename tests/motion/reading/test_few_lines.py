"""Notes that differ in numbers only are one line; words and names with digits are no numbers."""

from bumblebee.motion.reading.few_lines import few_lines, said_of


def lines(*said: str) -> list[tuple[str, str]]:
    return [(one.line, one.whose) for one in few_lines([(f"{n}.bvh", line) for n, line in enumerate(said)])]


def test_numbers_become_their_range_in_the_form_in_which_they_stood():
    said = [f"the floor was at {height} m, moved to 0" for height in ("-0.044", "+0.033", "0.001")]
    assert lines(*said) == [("the floor was at -0.044 to +0.033 m, moved to 0", "3 files")]


def test_a_number_at_the_end_of_a_sentence_is_one_and_digits_in_a_name_are_none():
    assert lines("took 1.5 s, then 2.", "took 2.5 s, then 2.") == [("took 1.5 to 2.5 s, then 2.", "2 files")]
    assert len(lines("joints of smpl_2.xml", "joints of smpl_3.xml")) == 2
    assert len(lines("CMU 01_02", "CMU 01_03")) == 2


def test_what_concerns_most_files_comes_first_and_a_file_counts_once():
    said = few_lines([("a", "x 1"), ("b", "y 1"), ("b", "y 3"), ("c", "y 2")])
    assert [(one.line, one.files) for one in said] == [("y 1 to 3", ("b", "c")), ("x 1", ("a",))]


def test_a_line_with_its_file_has_no_full_stop_before_it():
    assert said_of("noted", [("a.bvh", "no floor. Move it.")]) == ["noted: no floor. Move it: a.bvh"]
