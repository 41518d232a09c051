"""The pack's motions that a peer is tried on: by split and by name, the embedded ones left out."""

from pathlib import Path

from benchmarks.motion_pack import write_pack
from benchmarks.peers import clips_of
from tests.benchmarks.baselines.test_baselines import pieces


def test_motions_are_chosen_by_split_and_name_and_wholes_need_all_their_pieces(tmp_path: Path):
    rows = pieces("01_02", split="test") + pieces("01_03", dropped=1, split="test") + pieces("02_01")
    write_pack(tmp_path / "m.npz", rows + pieces("01_09", group="embedded", split="test"))

    def names(splits: list[str], only: list[str]) -> tuple[list[str], set[str]]:
        clips = clips_of(tmp_path / "m.npz", splits, only)
        return [clip.name for clip in clips["whole"]], {clip.name[:5] for clip in clips["pieces"]}

    assert names(["test"], []) == (["01_02"], {"01_02", "01_03"})
    assert names(["train", "test"], ["02_*"]) == (["02_01"], {"02_01"})
