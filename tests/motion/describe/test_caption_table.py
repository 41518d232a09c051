"""A user's table of captions: each row names its motion, a bad one is one line and costs no other."""

import re
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.captions import parse_caption
from bumblebee.motion.describe.table import CaptionTable


def table(folder: Path, text: str) -> CaptionTable:
    (folder / "captions.csv").write_text(text, encoding="utf-8")
    return CaptionTable.read(folder / "captions.csv")


def said(found) -> list[tuple[str, float, float]]:
    return [(text, since, until) for text, _, since, until in (parse_caption(row.line) for row in found)]


def test_rows_hold_captions_with_or_without_a_range(tmp_path):
    rows = 'motion,caption,from,to\nwalk,"a person walks, slowly",0.5,2\nwalk,a person turns,,\n'
    found = table(tmp_path, rows).of(Path("walk.bvh"), "walk")
    assert said(found) == [("a person walks, slowly", 0.5, 2.0), ("a person turns", 0.0, 0.0)]
    assert found[0].line.split("#")[1] == "person/OTHER walks/OTHER slowly/OTHER"
    assert said(table(tmp_path, "\ufeffcaption,motion\r\nshe jumps,jump\r\n").of(Path("jump"), "")) == [
        ("she jumps", 0, 0)
    ]


@pytest.mark.parametrize(
    ("motion", "meant"),
    [
        ("walk", True),
        ("walk.bvh", True),
        ("b/walk", True),
        ("a/b/walk.bvh", True),
        ("./a/b/walk.bvh", True),
        ("a\\b\\walk.bvh", True),
        ("walk_3", True),  # its name in a file of several
        ("Walk", False),
        ("walk.csv", False),
        ("c/walk.bvh", False),
        ("b", False),
        ("alk", False),
    ],
)
def test_a_motion_is_named_by_its_name_its_files_name_or_a_path_to_it(tmp_path, motion, meant):
    found = table(tmp_path, f"motion,caption\n{motion},a person walks\n").of(Path("a/b/walk.bvh"), "walk_3")
    assert bool(found) == meant


def test_letters_with_accents_are_alike_however_they_are_spelled(tmp_path):
    found = table(tmp_path, "motion,caption\nl\u00e4uft,a person runs\n").of(Path("la\u0308uft.csv"), "")
    assert len(found) == 1


def test_bad_rows_are_one_line_each_and_cost_no_other(tmp_path):
    rows = [
        "walk,a person walks,,",
        "walk,a person walks,,",  # alike
        "walk,number #1,,",
        ",nobody walks,,",
        "walk,,,",
        "walk,a person walks, then stops,,",
        "walk,a person walks,1,",
        "walk,a person walks,,2",
        "walk,a person walks,2,1",
        "walk,a person walks,-1,2",
        "walk,a person walks,nan,2",
        "walk,a person walks,1e9,1e10",
        "walk,a person walks,one,2",
        'walk,"a person walks,,',
        "walk,a \x1b[31mperson,,",
        f"walk,{'very ' * 300}slow,,",
        "walk",
        "",
        "turn,a person turns,1,2",
    ]
    found = table(tmp_path, "\n".join(["motion,caption,from,to", *rows]))
    assert [row.number for row in found.rows] == [2, 20]
    assert [int(re.search(r"line (\d+)[,:]", line)[1]) for line in found.bad] == list(range(3, 19))
    assert "line 2 again" in found.bad[0] and "without #" in found.bad[1] and "quotation marks" in found.bad[4]
    assert all(line.isprintable() and len(line) < 400 for line in found.bad)


@pytest.mark.parametrize(
    "header", ["", "motion;caption", "name,caption", "motion", "motion,caption,from", "motion,caption,until", "a,a"]
)
def test_other_columns_are_one_line(tmp_path, header):
    with pytest.raises(BadInput, match=r"captions\.csv, line 1: expected the columns motion,caption"):
        table(tmp_path, f"{header}\nwalk,a person walks\n")


def test_a_table_of_a_hundred_megabytes_is_refused(tmp_path):
    with (tmp_path / "captions.csv").open("wb") as stream:
        stream.truncate(100 << 20)
    with pytest.raises(BadInput, match="at most"):
        CaptionTable.read(tmp_path / "captions.csv")
