"""Each motion gets the text that is nearest to it, and what was given, dropped and left adds up."""

from pathlib import Path

import pytest

from bumblebee.clustering.text import TEXT_SOURCES, evidence
from bumblebee.errors import BadInput
from bumblebee.motion.captions import parse_caption
from bumblebee.motion.describe.accounting import account
from bumblebee.motion.describe.described import BEYOND, TWICE, UNREADABLE
from bumblebee.motion.describe.describer import DescribeConfig, describer

LINE = "a person walks#a/DET person/NOUN walk/VERB#0.0#0.0"


@pytest.fixture
def motions(tmp_path: Path) -> Path:
    """A folder in which CMU's 01_01 lies twice, once with a text beside it."""
    for place in ("cmu/a", "cmu/b", "mine"):
        (tmp_path / "motions" / place).mkdir(parents=True)
    (tmp_path / "motions/cmu/a/01_01.txt").write_text(LINE)
    return tmp_path / "motions"


def texts(told) -> list[str]:
    return [parse_caption(line)[0] for line in told.captions]


def put_table(motions: Path, rows: str) -> str:
    (motions / "captions.csv").write_text(f"motion,caption,from,to\n{rows}")
    return str(motions / "captions.csv")


def test_a_text_beside_the_motion_goes_before_the_table_and_the_table_before_humanml3d(motions, humanml3d):
    table = put_table(motions, "cmu/a/01_01.bvh,said of a,,\ncmu/b/01_01.bvh,said of b,,\n")
    all_of_them = describer(DescribeConfig("", table, str(humanml3d), True), motions)
    no_table = describer(DescribeConfig("", "", str(humanml3d), True), motions)
    told = [
        all_of_them.captions(motions / "cmu/a/01_01.bvh", "01_01", 30.0),
        all_of_them.captions(motions / "cmu/b/01_01.bvh", "01_01", 30.0),
        no_table.captions(motions / "cmu/b/01_01.bvh", "01_01", 30.0),
        no_table.captions(motions / "mine/slow_walk.csv", "slow_walk", 30.0),
    ]
    assert [one.source for one in told] == ["file", "csv", "humanml3d", "name"]
    assert [texts(one)[0] for one in told] == [
        "a person walks",
        "said of b",
        "a person kicks left",
        "a person performs slow walk",
    ]
    assert [one.licence for one in told] == ["", "", "MIT", ""]


def test_a_motion_without_text_gets_none_unless_words_of_names_are_asked_for_and_those_are_no_evidence(motions):
    path = motions / "mine/slow_walk.csv"
    assert describer(DescribeConfig(), motions).captions(path, "slow_walk", 5.0).captions == ()
    told = describer(DescribeConfig(name_words=True), motions).captions(path, "slow_walk", 5.0)
    assert told.source == "name" and evidence(told.captions, told.source, "another") == ()
    assert {"file", "csv", "humanml3d"} <= set(TEXT_SOURCES) and "name" not in TEXT_SOURCES


def test_texts_lie_in_a_folder_by_path_or_by_name(motions, tmp_path):
    (tmp_path / "texts/cmu/b").mkdir(parents=True)
    (tmp_path / "texts/01_01.txt").write_text(LINE.replace("walks", "runs"))
    (tmp_path / "texts/cmu/b/01_01.txt").write_text(LINE.replace("walks", "hops"))
    say = describer(DescribeConfig(str(tmp_path / "texts")), motions)
    assert texts(say.captions(motions / "cmu/a/01_01.bvh", "", 5.0)) == ["a person runs"]
    assert texts(say.captions(motions / "cmu/b/01_01.bvh", "", 5.0)) == ["a person hops"]
    (tmp_path / "01_02.txt").write_text(LINE)  # outside, where a member's name must not lead
    assert say.captions(motions / "a.zip/../../../01_02.bvh", "", 5.0).captions == ()


def test_bad_lines_and_ranges_beyond_the_motion_cost_themselves_alone(motions):
    beside = motions / "mine/jump.txt"
    beside.write_text(f"{LINE}\nno caption\na#b/X#1.0#9.0\na#b/X#1.0#5.1\n")
    told = describer(DescribeConfig(), motions).captions(motions / "mine/jump.csv", "jump", 5.0)
    assert told.captions == (LINE, "a#b/X#1.000#5.000") and told.dropped == (UNREADABLE, BEYOND)
    assert "jump.txt, line 2: expected caption#tokens" in told.notes[0]
    assert "jump.txt, line 3: expected a range within its motion of 5.00 s, came 1 to 9 s" in told.notes[1]


def test_where_a_nearer_text_gives_nothing_the_next_is_asked_and_the_reason_kept(motions, humanml3d):
    (motions / "cmu/a/01_01.txt").write_bytes(b"\xff\xfe")
    table = put_table(motions, "01_01,too long,0,99\n")
    say = describer(DescribeConfig("", table, str(humanml3d)), motions)
    told = say.captions(motions / "cmu/a/01_01.bvh", "01_01", 30.0)
    assert told.source == "humanml3d" and told.dropped == (UNREADABLE, BEYOND) and len(told.notes) == 2
    assert account(say, [told]).rows == {"dropped": 1}


def test_a_table_or_data_set_that_is_not_there_is_one_line(motions):
    for config in (DescribeConfig(captions_csv="none.csv"), DescribeConfig(humanml3d="none")):
        with pytest.raises(BadInput, match="no such file"):
            describer(config, motions)


def test_all_that_was_read_is_accounted_for(motions, humanml3d):
    rows = [
        "01_01,said of both,,",  # two motions: one has a text beside it, the other uses this row
        "cmu/b/01_01.bvh,said of both,,",  # the same again, by another name
        "slow_walk,a walk,0,4",
        "slow_walk,too late,8,9",
        "cmu/a/01_01,passed over,,",
        "jump9,nobody,,",
        "bad,row # here,,",
    ]
    say = describer(DescribeConfig("", put_table(motions, "\n".join(rows)), str(humanml3d)), motions)
    paths = ["cmu/a/01_01.bvh", "cmu/b/01_01.bvh", "mine/slow_walk.csv", "cmu/18_13.bvh", "mine/other.csv"]
    told = [say.captions(motions / path, Path(path).stem, 5.0) for path in paths]
    total = account(say, told)
    assert total.motions == {"csv": 2, "file": 1, "none": 2} and sum(total.motions.values()) == len(paths)
    assert total.captions == {"csv": 2, "file": 1}
    assert total.dropped == {BEYOND: 1, TWICE: 1}
    assert total.rows == {"bad": 1, "dropped": 2, "of no motion": 1, "passed over": 1, "used": 2}
    assert sum(total.rows.values()) == len(rows)
    assert len(total.several) == 1 and "line 2: 01_01 names 2 motions" in total.several[0]
    assert ["line 8" in total.notes[0], "line 7: no motion jump9" in total.notes[1]] == [True, True]
    assert set(total.as_dict()) == {"motions", "captions", "dropped", "rows"}
