"""What lies at a path, file by file; people's motion comes through its own readers; counts add up."""

from pathlib import Path

import joblib
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.read import RobotConfig
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.inspect import Counts, inspect
from bumblebee.motion.listing import Readers, find_motions
from bumblebee.motion.sources import Source
from bumblebee.motion.store import write_library
from bumblebee.motion.walk import motion_sources

CONFIG = RobotConfig(csv_fps=30)


def person(path: Path, data: bytes) -> list[HumanMotion]:
    """Stands for the readers of people's motion."""
    if b"bad" in data:
        raise BadInput(f"{path}, line 3", "a number", "'bad'")
    positions = np.ones((25, len(LANDMARKS), 3))
    return [HumanMotion(path.stem, 120.0, positions, path, notes=("y up",))]


FAKES = Readers(motion_sources, person)


def test_a_folder_of_everything_gives_rows_and_counts_that_add_up(motions, tmp_path):
    raw = motions.raw()
    motions.csv(raw, "good.csv")
    (tmp_path / "good.txt").write_text("a person sways.#a/B#0#0\n")
    motions.csv(motions.raw(joint_pos=raw.joint_pos * 60), "degrees.csv")
    (tmp_path / "cut.pkl").write_bytes(motions.pickle(raw, "whole.pkl").read_bytes()[:100])
    joblib.dump({"a": motions.fields(raw), "b": motions.fields(motions.raw(5))}, tmp_path / "two.pkl")
    (tmp_path / "walk.bvh").write_text("good")
    (tmp_path / "fall.bvh").write_text("bad")
    (tmp_path / "LICENCE").write_text("MIT License")
    counts, rows = Counts(), {}
    for found in inspect(tmp_path, CONFIG, FAKES):
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
    assert rows["fall.bvh", ""].problem == "line 3: expected a number, came 'bad'"
    walk = rows["walk.bvh", "walk"]
    assert (walk.format, walk.joints, walk.notes, walk.fps) == ("person .bvh", 0, ("y up",), 120)
    assert str(counts).startswith("7 files: 5 read, 2 not. 6 motions: 4 usable")


def test_without_readers_of_people_their_files_are_refused_by_name(tmp_path):
    (tmp_path / "walk.bvh").write_text("good")
    (found,) = find_motions(tmp_path, CONFIG, Readers(motion_sources))
    assert not found.motions and "expected a motion of the G1" in found.reason


def test_a_library_counts_clip_by_clip_and_a_damaged_one_is_a_line_for_each(motions, tmp_path):
    write_library(tmp_path / "lib", [motions.clip(name) for name in ("a", "b", "c")])
    (rows,) = list(inspect(tmp_path / "lib", CONFIG, FAKES))[:1]
    assert rows[0].format == rows[0].rate_from == "library" and rows[0].name == "a"
    (shard,) = (tmp_path / "lib/clips").iterdir()
    shard.write_bytes(shard.read_bytes()[:200])
    found = list(find_motions(tmp_path / "lib", CONFIG, FAKES))
    assert [one.path.name for one in found] == ["a", "b", "c"]
    assert all(one.reason and not one.motions for one in found)


def test_members_of_archives_are_read_by_their_own_names(motions, tmp_path):
    data = motions.pickle(motions.raw()).read_bytes()
    member = Source(tmp_path / "all.zip" / "index.pkl", lambda most: data, tmp_path / "all.zip")
    (found,) = find_motions(tmp_path, CONFIG, Readers(lambda path: iter([member]), person))
    assert found.path == member.path and len(found.motions) == 1


def test_a_mistake_of_ours_costs_one_file(motions, tmp_path):
    def broken(path, data):
        raise ZeroDivisionError("oops")

    (tmp_path / "a.bvh").write_text("good")
    motions.csv(motions.raw(), "b.csv")
    found = list(find_motions(tmp_path, CONFIG, Readers(motion_sources, broken)))
    assert "ZeroDivisionError: oops): please report this" in found[0].reason and found[1].motions


@pytest.mark.parametrize(("name", "came"), [("", "none"), ("nowhere", "no such file or folder")])
def test_nothing_there_is_said(tmp_path, name, came):
    with pytest.raises(BadInput, match=f"expected a motion file, or a folder that holds some, came {came}"):
        list(find_motions(tmp_path / name, CONFIG, FAKES))
