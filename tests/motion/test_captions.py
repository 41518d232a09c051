"""Captions keep HumanML3D's line format through reading, naming and cutting."""

import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.captions import caption_from_name, family_of, find_captions, parse_caption, read_captions

LINE = "a person walks forward.#a/DET person/NOUN walk/VERB forward/ADV#0.5#2.0"


def test_a_line_is_taken_apart():
    assert parse_caption(LINE) == ("a person walks forward.", "a/DET person/NOUN walk/VERB forward/ADV", 0.5, 2.0)
    assert parse_caption("a#b/X#nan#nan")[2:] == (0.0, 0.0)


@pytest.mark.parametrize("line", ["no hash", "a#b", "a#b#0#1#2", "#b#0#1", "a#b#zero#1"])
def test_a_line_in_another_form_is_named(tmp_path, line):
    (tmp_path / "a.txt").write_text(f"{LINE}\n{line}\n")
    with pytest.raises(BadInput, match=r"a\.txt, line 2: expected"):
        read_captions(tmp_path / "a.txt")


def test_captions_lie_in_the_folder_or_beside_the_motion(tmp_path):
    (tmp_path / "texts").mkdir()
    (tmp_path / "walk.txt").write_text(f"{LINE}\n\n{LINE}\n")
    (tmp_path / "texts/jump.txt").write_text("a person jumps#a/X#0.0#0.0")
    assert find_captions(tmp_path / "walk.csv", "") == (LINE, LINE)
    assert find_captions(tmp_path / "jump.csv", tmp_path / "texts") == ("a person jumps#a/X#0.0#0.0",)
    assert find_captions(tmp_path / "squat.csv", tmp_path / "texts") == ()


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
