"""Captions keep HumanML3D's line format through reading, naming and cutting."""

import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.captions import caption_from_name, family_of, parse_caption
from bumblebee.motion.describe.describer import beside

LINE = "a person walks forward.#a/DET person/NOUN walk/VERB forward/ADV#0.5#2.0"


def test_a_line_is_taken_apart():
    assert parse_caption(LINE) == ("a person walks forward.", "a/DET person/NOUN walk/VERB forward/ADV", 0.5, 2.0)
    assert parse_caption("a#b/X#nan#nan")[2:] == (0.0, 0.0)


@pytest.mark.parametrize("line", ["no hash", "a#b", "a#b#0#1#2", "#b#0#1", "a#b#zero#1"])
def test_a_line_in_another_form_is_named(line):
    with pytest.raises(BadInput, match=r"a\.txt, line 2: expected"):
        parse_caption(line, "a.txt, line 2")


def test_the_text_beside_a_motion_is_its_caption(tmp_path):
    (tmp_path / "walk.txt").write_text(f"{LINE}\n\nno hash\n")
    told = beside(tmp_path / "walk.csv", 4.0)
    assert (told.captions, told.source) == ((LINE.replace("0.5#2.0", "0.500#2.000"),), "file")
    assert len(told.notes) == 1 and "walk.txt, line 3: expected" in told.notes[0]
    assert beside(tmp_path / "squat.csv", 4.0).captions == ()


@pytest.mark.parametrize(
    ("name", "said", "family"),
    [
        ("B_AttackKarate", "attack karate", "karate"),
        ("J_Dance11_Gnarly", "dance gnarly", "dance"),
        ("single_foot_jump_level2", "single foot jump", "jump"),
        ("step_forward_back_level1", "step forward back", "step"),
        ("0042", "move", ""),
    ],
)
def test_a_name_becomes_a_caption_and_a_family(name, said, family):
    text, tokens, start, end = parse_caption(caption_from_name(name))
    assert text == f"a person performs {said}"
    assert [token.split("/")[0] for token in tokens.split()] == ["a", "person", "perform", *said.split()]
    assert (start, end) == (0.0, 0.0)
    assert family_of(name) == family
