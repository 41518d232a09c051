"""List of a path, file by file, of the robot and of people; counts add up."""

import zipfile

import joblib
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.reading.files import find_motions
from bumblebee.motion.reading.inspect import Counts, inspect
from bumblebee.motion.reading.one_file import FileConfig
from bumblebee.motion.store import write_library
from tests.motion.human.people import bvh

CONFIG = FileConfig(csv_fps=30)


def test_a_folder_of_everything_gives_rows_and_counts_that_add_up(motions, tmp_path):
    raw = motions.raw()
    motions.csv(raw, "good.csv")
    (tmp_path / "good.txt").write_text("a person sways.#a/B#0#0\n")
    motions.csv(motions.raw(joint_pos=raw.joint_pos * 60), "degrees.csv")
    (tmp_path / "cut.pkl").write_bytes(motions.pickle(raw, "whole.pkl").read_bytes()[:100])
    joblib.dump({"a": motions.fields(raw), "b": motions.fields(motions.raw(5))}, tmp_path / "two.pkl")
    (tmp_path / "walk.bvh").write_text(bvh())
    (tmp_path / "fall.bvh").write_text(bvh().replace("Frames: 40", "Frames: 41"))
    (tmp_path / "LICENCE").write_text("MIT License")
    counts, rows = Counts(), {}
    for found in inspect(tmp_path, CONFIG):
        counts.add(found)
        rows |= {(row.file.name, row.name): row for row in found}
    assert (counts.files, counts.unreadable, counts.motions, counts.faulty, counts.usable) == (7, 2, 6, 2, 4)
    good = rows["good.csv", "good"]
    assert (good.frames, good.fps, good.rate_from, good.captions, good.joints) == (80, 30, "setting", 1, 23)
    assert good.seconds == pytest.approx(79 / 30) and good.licence == "MIT" and not good.problem
    assert 0.6 < good.height[0] < good.height[1] < 0.9
    assert "expected radians" in rows["degrees.csv", "degrees"].problem
    assert rows["two.pkl", "two_b"].problem == "motion 'b': expected at least 10 frames, came 5 frames"
    assert "ends early" in rows["cut.pkl", ""].problem and "cut.pkl" not in rows["cut.pkl", ""].problem
    assert "41" in rows["fall.bvh", ""].problem
    walk = rows["walk.bvh", "walk"]
    assert (walk.format, walk.joints, round(walk.fps)) == ("person .bvh", 0, 120)
    assert any("cm" in note for note in walk.notes)
    assert str(counts).startswith("7 files: 5 read, 2 not. 6 motions: 4 usable")


def test_a_library_counts_clip_by_clip_and_a_damaged_one_is_a_line_for_each(motions, tmp_path):
    write_library(tmp_path / "lib", [motions.clip(name) for name in ("a", "b", "c")])
    (rows,) = list(inspect(tmp_path / "lib", CONFIG))[:1]
    assert rows[0].format == rows[0].rate_from == "library" and rows[0].name == "a"
    (shard,) = (tmp_path / "lib/clips").iterdir()
    shard.write_bytes(shard.read_bytes()[:200])
    found = list(find_motions(tmp_path / "lib", CONFIG))
    assert [one.path.name for one in found] == ["a", "b", "c"]
    assert all(one.reason and not one.motions for one in found)


def test_members_of_archives_are_read_by_their_own_names(motions, tmp_path):
    data = motions.pickle(motions.raw()).read_bytes()
    with zipfile.ZipFile(tmp_path / "all.zip", "w") as archive:
        archive.writestr("deep/index.pkl", data)
        archive.writestr("LICENSE", "MIT License")
    (found,) = find_motions(tmp_path / "all.zip", CONFIG)
    assert found.path == tmp_path / "all.zip/deep/index.pkl" and len(found.motions) == 1 and found.licence == "MIT"


def test_a_mistake_of_ours_costs_one_file(motions, tmp_path, monkeypatch):
    def broken(path, data, config):
        raise ZeroDivisionError("oops")

    (tmp_path / "a.bvh").write_text(bvh())
    motions.csv(motions.raw(), "b.csv")
    monkeypatch.setattr("bumblebee.motion.reading.one_file.read_human", broken)
    found = list(find_motions(tmp_path, CONFIG))
    assert "ZeroDivisionError: oops): please report this" in found[0].reason and found[1].motions


@pytest.mark.parametrize(("name", "came"), [("", "none"), ("nowhere", "no such file or folder")])
def test_nothing_there_is_said(tmp_path, name, came):
    with pytest.raises(BadInput, match=f"expected a motion file, or a folder that holds some, came {came}"):
        list(find_motions(tmp_path / name, CONFIG))
