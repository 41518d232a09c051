"""Sets are compared on the motions that all have; what only one of two follows is named."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.motion_pack import read_pack, whole_motions, write_pack
from benchmarks.retarget.follow import common, compared, markdown, trials_of
from bumblebee.errors import BadInput
from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import stand_pose


def clip(name: str):
    return make_clip(
        name, 50.0, np.tile([0, 0, 0.8], (6, 1)), np.tile([1.0, 0, 0, 0], (6, 1)), np.tile(stand_pose(), (6, 1))
    )


def run(folder: Path, success: dict[str, bool]) -> Path:
    folder.mkdir()
    rows = [
        (name, kind, done if kind == "whole" else True) for name, done in success.items() for kind in ("whole", "p")
    ]
    pd.DataFrame(rows, columns=["name", "kind", "success"]).to_csv(folder / "trials.csv", index=False)
    return folder


def test_a_set_keeps_the_names_that_all_have_and_learns_from_all_of_them(tmp_path):
    sets = common({"a": [clip("kick"), clip("bow")], "b": [clip("bow"), clip("kick"), clip("walk")]})
    write_pack(tmp_path / "b.npz", sets["b"])
    whole = whole_motions(read_pack(tmp_path / "b.npz"))
    assert [row.clip.name for row in sets["a"]] == [row.clip.name for row in whole] == ["bow", "kick"]
    assert {(row.group, row.clip.split) for row in whole} == {("b", "train")}
    with pytest.raises(BadInput, match="no name"):
        common({"a": [clip("kick")], "b": [clip("bow")]})


def test_shares_are_over_whole_motions_and_all_seeds_and_pairs_are_by_motion(tmp_path):
    ours = [
        run(tmp_path / "o0", {"bow": True, "kick": True, "jump": True}),
        run(tmp_path / "o1", {"bow": True, "kick": False, "jump": True}),
    ]
    theirs = [run(tmp_path / "t0", {"jump": False, "kick": True, "bow": True})]
    alone, (pair,) = compared({"ours": trials_of(ours), "theirs": trials_of(theirs)})
    assert [(row["followed"], row["value"]) for row in alone] == [([3, 2], 5 / 6), ([2], 2 / 3)]
    assert (pair["both"], pair["only_first"], pair["only_second"]) == (1, ["jump"], ["kick"])
    assert pair["difference"] == pytest.approx((0 - 0.5 + 1) / 3)
    assert pair["p"] == 1
    assert "| ours, theirs | 3 | 1 | 1 | 1 | +0.17 | 1 |" in markdown(alone, [pair])


def test_runs_of_other_motions_are_refused(tmp_path):
    runs = [run(tmp_path / "a", {"bow": True}), run(tmp_path / "b", {"kick": True})]
    with pytest.raises(BadInput, match="same motions"):
        trials_of(runs)
    with pytest.raises(BadInput, match="no such file"):
        trials_of([tmp_path / "none"])
