"""Files of settings: no key twice, and a folder is none."""

from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.io.read import parse_yaml, read_text


@pytest.mark.parametrize(
    ("text", "line", "key"),
    [
        ("a: 1\nb: 2\na: 3\n", 3, "a"),
        ("x:\n  - {b: 1, b: 1}\n", 2, "b"),
        ("a: &x {}\nb:\n  <<: *x\n  <<: *x\n", 4, "<<"),
    ],
)
def test_a_key_that_stands_twice_is_named_with_its_line(text: str, line: int, key: str):
    with pytest.raises(BadInput, match=f"file, line {line}: expected YAML of plain values, came the key '{key}' twice"):
        parse_yaml("file", text)


def test_what_is_merged_may_be_said_again():
    text = "a: &one {x: 1, y: 2}\nb: &two {<<: *one, x: 3}\nc: {<<: [*two, *one], y: 4}\n"
    assert parse_yaml("file", text)["c"] == {"x": 3, "y": 4}


def test_a_folder_is_called_one(tmp_path: Path):
    with pytest.raises(BadInput, match="expected a file, came a folder"):
        read_text(tmp_path)
