"""BVH is read as it is written, and what is wrong with it is said in one line."""

from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.human.bvh import parse_bvh, rate
from bumblebee.motion.human.forward import bvh_positions
from tests.motion.human.people import COLUMNS, JOINTS, bvh, hierarchy, rows

FILE = Path("a.bvh")
CHAIN = """HIERARCHY
ROOT a
{{
 OFFSET 1 2 3
 CHANNELS {root}
 JOINT b {{
  OFFSET 0 0 2
  CHANNELS {own}
  End Site
  {{
   OFFSET 0 1 0
  }}
 }}
}}
MOTION
Frames: 2
Frame Time: 0.05
{row}
{row}
"""


def chain(row: str, root: str = "3 Zrotation Xrotation Yrotation", own: str = "3 Xrotation Yrotation Zrotation"):
    return parse_bvh(FILE, CHAIN.format(root=root, own=own, row=row).encode())


def axis(which: int, degrees: float) -> np.ndarray:
    one, two = (which + 1) % 3, (which + 2) % 3
    out, angle = np.eye(3), np.radians(degrees)
    out[one, one] = out[two, two] = np.cos(angle)
    out[two, one], out[one, two] = np.sin(angle), -np.sin(angle)
    return out


def test_the_names_parents_offsets_and_rate_are_those_of_the_file():
    found = parse_bvh(FILE, bvh(frames=7).encode())
    joints = [i for i, name in enumerate(found.names) if not name.endswith("/end")]
    assert sorted(found.names[i] for i in joints) == sorted(name for name, *_ in JOINTS)
    for i in joints:
        _, parent, offset = next(joint for joint in JOINTS if joint[0] == found.names[i])
        assert (found.names[found.parents[i]] if found.parents[i] >= 0 else "") == parent
        assert found.offsets[i] == pytest.approx([100 * value for value in offset])
    assert found.fps == 120 and found.values.shape == (7, COLUMNS)


def test_rotations_apply_in_the_order_of_their_channels():
    found = chain("10 20 30 40 50 60")
    root = axis(2, 10) @ axis(0, 20) @ axis(1, 30)
    own = axis(0, 40) @ axis(1, 50) @ axis(2, 60)
    b = np.array([1, 2, 3]) + root @ [0, 0, 2]
    places = bvh_positions(found, [2, 1, 0])[1]
    np.testing.assert_allclose(places, [b + root @ own @ [0, 1, 0], b, [1, 2, 3]], atol=1e-12)


def test_positions_take_the_place_of_an_offset_and_may_stand_after_the_rotations():
    found = chain("90 5 6 7 0.1 0.2 2.3", root="4 Zrotation Xposition Yposition Zposition",
                  own="3 Xposition Yposition Zposition")  # fmt: skip
    np.testing.assert_allclose(bvh_positions(found, [0, 1])[0], [[5, 6, 7], [4.8, 6.1, 9.3]], atol=1e-12)


def test_positions_near_zero_are_added_to_the_offset():
    found = chain("0 0 0 0.1 0.2 0.3", own="3 Xposition Yposition Zposition")
    np.testing.assert_allclose(bvh_positions(found, [1])[0], [[1.1, 2.2, 5.3]], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "hertz"),
    [(".0083333", 120), ("0.033333", 30), ("0.0333", 30), ("0.0333667", 1 / 0.0333667), ("0.02", 50), ("0.016667", 60),
     ("8.33333e-3", 1 / 8.33333e-3), ("1", 1)],
)  # fmt: skip
def test_a_frame_time_is_the_whole_rate_that_it_abbreviates(text, hertz):
    assert rate(text) == pytest.approx(hertz, rel=1e-12)


def changed(old: str, new: str, count: int = 1) -> str:
    text = bvh(frames=5)
    assert old in text
    return text.replace(old, new, count)


def cut_row(values: int) -> str:
    lines = bvh(frames=5).splitlines()
    lines[-2] = " ".join((lines[-2].split() * 2)[:values])
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (changed("\tCHANNELS 3 Zrotation Yrotation Xrotation\n", ""), "its CHANNELS before its brace closes"),
        (changed("CHANNELS 3 Zrotation Yrotation Xrotation", "CHANNELS 3 Zrotation Yrotation"), "3 and 2 names"),
        (changed("Zrotation Yrotation Xrotation", "Zrotation Zrotation Xrotation"), "once at most"),
        (cut_row(COLUMNS - 1), f"frame 4: expected {COLUMNS} values, as many as channels, came {COLUMNS - 1}"),
        (cut_row(COLUMNS + 1), f"frame 4: expected {COLUMNS} values, as many as channels, came {COLUMNS + 1}"),
        (bvh(frames=5).replace(".", ","), "commas for decimal points"),
        (changed("\n0 96 0", "\n0 96,5 0"), "must be points, not commas"),
        (changed("Frames: 5", "Frames: 6"), "expected 6 frames or more, as its line Frames: says"),
        (changed("Frames: 5", "Frames: 0"), "Frames:: expected 1 to 500,000, came 0"),
        (changed("Frames: 5", "Frames: 99999999999"), "expected 1 to 500,000"),
        (changed("Frame Time: 0.0083333", "Frame Time: 0"), "Frame Time:: expected 0.001 to 1 s, came 0"),
        (changed("Frame Time: 0.0083333", "Frame Time: nan"), "came nan"),
        (changed("Frame Time: 0.0083333", "Frame Time: 0,0083"), "a comma for the decimal point"),
        (changed("\n0 96 0", "\n0 nan 0"), "frame 1, value 2: expected a number up to 1e+07, came 'nan'"),
        (changed("\n0 96 0", "\n0 1e30 0"), "came '1e30'"),
        (changed("\n0 96 0", "\n0 9_6 0"), "came '9_6'"),
        (bvh(frames=5)[:-600], "Export or copy the file again"),
        (bvh(frames=5).partition("MOTION")[0], "no line MOTION"),
        (hierarchy()[:-1] + "\nMOTION\nFrames: 1\nFrame Time: 0.1\n0\n", "an open one"),
        ("", "another beginning"),
        (changed("MOTION", "ROOT b\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\nMOTION"), "Keep one person a file"),
        (changed("OFFSET 0.0 0.0 0.0", "OFFSET 0 0"), "three finite numbers"),
        (changed("\tOFFSET 0.0 0.0 0.0\n", ""), "its OFFSET before its brace closes"),
        (changed("ROOT Hips", "ROOT"), "ROOT and a name"),
    ],
)
def test_what_is_wrong_is_one_line(text, words):
    with pytest.raises(BadInput) as caught:
        parse_bvh(FILE, text.encode())
    assert words in str(caught.value) and str(caught.value).startswith("a.bvh") and "\n" not in str(caught.value)


@pytest.mark.parametrize("said", [3, 4])
def test_more_rows_than_the_file_says_are_all_read_with_a_note(said):
    more, whole = parse_bvh(FILE, changed("Frames: 5", f"Frames: {said}").encode()), parse_bvh(FILE, bvh(5).encode())
    np.testing.assert_array_equal(more.values, whole.values)
    assert more.notes == (f"Frames: says {said}, all 5 rows are read",) and whole.notes == ()


def test_windows_line_ends_tabs_and_blank_lines_at_the_end_are_read():
    text = bvh(frames=5).replace("Frames: ", "Frames:\t").replace("\n", "\r\n") + "\r\n \r\n"
    np.testing.assert_allclose(parse_bvh(FILE, text.encode()).values, rows(5), rtol=1e-5)
