"""Names from data stay inside their folder, and no two become one."""

from pathlib import PurePosixPath

import pytest

from bumblebee.errors import BadInput
from bumblebee.io.names import LONGEST, distinct_stems, require_stem, safe_stem

HOSTILE = [
    "/../../x",
    "..",
    ".",
    "",
    "a/../../b",
    "\\..\\..\\c",
    "a\0b",
    ".hidden",
    "é" * 500,
    "-rf",
    "a\nb",
    None,
    3.5,
]


@pytest.mark.parametrize("text", HOSTILE)
def test_a_safe_name_is_one_visible_component(text: object):
    name = safe_stem(text)
    assert len(PurePosixPath(name).parts) == 1
    assert name not in ("", ".", "..") and name[0] not in ".-" and "/" not in name and "\0" not in name
    assert len(name.encode()) <= LONGEST
    assert safe_stem(name) == name


def test_a_plain_name_stays():
    assert [safe_stem(name) for name in ("walk-1", "B3_stand.up", "ボクシング")] == [
        "walk-1",
        "B3_stand.up",
        "ボクシング",
    ]


def test_slashes_are_not_lost():
    assert safe_stem("run/3") == "run_3"
    assert safe_stem("/../../x") == "x"


def test_distinct_names_are_distinct_in_any_case():
    names = distinct_stems(["a/b", "a_b", "A_B", None, "/"])
    assert len({name.casefold() for name in names}) == 5


@pytest.mark.parametrize("text", ["", ".a", "a/b", "a\\b", "a\0", "x" * 200, 3, None])
def test_a_name_that_cannot_stand_is_refused(text: object):
    with pytest.raises(BadInput):
        require_stem("x", text)
