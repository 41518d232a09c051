"""Converted motions keep name, licence, source and rate; nothing is half written, and nothing else overwritten."""

import csv
import os

import joblib
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.convert import KINDS, ConvertConfig, convert
from bumblebee.motion.formats.read import read_robot
from bumblebee.motion.licences.table import LICENCES
from bumblebee.motion.reading.one_file import FileConfig
from bumblebee.motion.store import read_library
from tests.motion.human.people import bvh

CSV = FileConfig(csv_fps=30)


@pytest.fixture
def source(motions, tmp_path):
    """Two folders with a motion of one name each, and one that is bad."""
    raw = motions.raw()
    motions.csv(raw, "in/one/sway.csv")
    motions.pickle(raw, "in/two/sway.pkl")
    (tmp_path / "in/two/bad.pkl").write_bytes(b"no pickle")
    (tmp_path / "in/two/LICENSE").write_text("MIT License")
    return tmp_path / "in"


def rows_of(out):
    with (out / LICENCES).open() as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(("kind", "suffix"), [("g1_csv", ".csv"), ("asap", ".pkl"), ("mjlab", ".npz")])
def test_every_motion_is_written_with_its_licence_and_source(motions, source, tmp_path, kind, suffix):
    told = []
    done = convert(source, tmp_path / "out", ConvertConfig(kind, files=CSV), tell=told.append)
    assert (done.files, done.written, len(done.skipped)) == (3, 2, 1) and told[0].startswith("two/bad.pkl: expected")
    assert sorted(os.listdir(tmp_path / "out")) == [LICENCES, f"sway{suffix}", f"two_sway{suffix}"]
    first, second = rows_of(tmp_path / "out")
    rate = "50" if kind == "mjlab" else "30"
    assert first == {
        "file": f"sway{suffix}",
        "motion": "sway",
        "fps": rate,
        "source": "one/sway.csv",
        "licence": "unknown",
    }
    assert (second["source"], second["licence"]) == ("two/sway.pkl", "MIT")
    path = tmp_path / "out" / f"two_sway{suffix}"
    (raw,) = read_robot(path, path.read_bytes(), CSV.robot)
    if rate == "30":
        np.testing.assert_array_equal(raw.joint_pos.astype(np.float32), motions.raw().joint_pos.astype(np.float32))
    else:
        assert len(raw.joint_pos) == 132 and raw.fps == 50


def test_licence_source_and_rate_travel_through_all_formats(source, tmp_path):
    convert(source / "two", tmp_path / "a", ConvertConfig("g1_csv", fps=37.0))
    convert(tmp_path / "a", tmp_path / "b", ConvertConfig("asap"))  # the rate stands in the first one's table
    convert(tmp_path / "b", tmp_path / "c", ConvertConfig("library"))
    (clip,) = read_library(tmp_path / "c")
    assert (clip.name, clip.licence, clip.source, clip.fps) == ("sway", "MIT", "two/sway.pkl", 50.0)
    convert(tmp_path / "c", tmp_path / "d", ConvertConfig("mjlab"))
    assert rows_of(tmp_path / "d")[0]["licence"] == "MIT"
    (row,) = rows_of(tmp_path / "b")
    assert (row["fps"], row["source"]) == ("37", "two/sway.pkl")


def test_csv_files_of_several_rates_are_refused_whole(motions, tmp_path):
    motions.pickle(motions.raw(fps=30.0), "in/a.pkl")
    motions.pickle(motions.raw(fps=60.0), "in/b.pkl")
    with pytest.raises(
        BadInput, match=r"one rate for files that hold none, came 30 and 60 Hz \(b\)\. Say it: --fps 30"
    ):
        convert(tmp_path / "in", tmp_path / "out", ConvertConfig("g1_csv"))
    assert sorted(os.listdir(tmp_path)) == ["in"]
    assert convert(tmp_path / "in", tmp_path / "out", ConvertConfig("g1_csv", fps=30.0)).rates == {30.0}


@pytest.mark.parametrize("kind", KINDS)
def test_an_earlier_result_is_replaced_when_asked_and_anything_else_is_not(motions, source, tmp_path, kind):
    out, config = tmp_path / "out", ConvertConfig(kind, files=CSV)
    convert(source, out, config)
    with pytest.raises(BadInput, match=r"converted before\. Add --overwrite"):
        convert(source, out, config)
    convert(source / "two", out, config, overwrite=True)
    assert len(os.listdir(out)) == (3 if kind == "library" else 2)
    (out / "mine.txt").write_text("precious")
    with pytest.raises(BadInput, match="came something else"):
        convert(source, out, config, overwrite=True)
    assert (out / "mine.txt").read_text() == "precious"


def test_places_that_are_inputs_are_refused(source, tmp_path):
    for out in (source, source.parent, source / "new", source / "two"):
        with pytest.raises(BadInput):
            convert(source, out, ConvertConfig("asap", files=CSV), overwrite=True)
    assert sorted(os.listdir(source / "two")) == ["LICENSE", "bad.pkl", "sway.pkl"]


def test_nothing_usable_writes_nothing(tmp_path, source):
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad/a.pkl").write_bytes(b"")
    with pytest.raises(BadInput, match=r"came none that can be used; the first: a\.pkl: expected a pickle"):
        convert(tmp_path / "bad", tmp_path / "out", ConvertConfig("mjlab"))
    assert not (tmp_path / "out").exists()


def test_people_are_retargeted(motions, tmp_path):
    motions.pickle(motions.raw(), "in/a.pkl")
    (tmp_path / "in/b.bvh").write_text(bvh(frames=60))
    done = convert(tmp_path / "in", tmp_path / "out", ConvertConfig("asap"))
    assert done.written == 2 and not done.skipped
    (raw,) = read_robot(tmp_path / "out/b.pkl", (tmp_path / "out/b.pkl").read_bytes())
    assert raw.fps == 50 and 0.6 < raw.root_pos[:, 2].mean() < 0.85


def test_a_motion_that_fails_a_check_is_skipped_by_its_name(motions, tmp_path):
    good, bad = motions.fields(motions.raw()), motions.fields(motions.raw())
    bad["dof"] = bad["dof"] * 60
    (tmp_path / "in").mkdir()
    joblib.dump({"good": good, "bad": bad}, tmp_path / "in/two.pkl")
    done = convert(tmp_path / "in", tmp_path / "out", ConvertConfig("mjlab"))
    assert done.written == 1 and done.skipped[0][0] == "two.pkl, two_bad" and "radians" in done.skipped[0][1]


def test_names_with_dots_stay_apart_where_asap_cuts_them(motions, tmp_path):
    for name in ("in/walk.1.pkl", "in/walk_1.pkl"):
        motions.pickle(motions.raw(), name)
    convert(tmp_path / "in", tmp_path / "out", ConvertConfig("asap"))
    files = sorted(path for path in os.listdir(tmp_path / "out") if path != LICENCES)
    assert len(files) == 2
    for file in files:
        assert list(joblib.load(tmp_path / "out" / file)) == [file.split(".")[0]]


def test_many_motions_of_one_name_and_one_called_like_the_table_stay_apart(motions, tmp_path):
    for name in ("in/a/LICENCES.pkl", "in/a/Walk.pkl", "in/b/walk.pkl", "in/c/walk.pkl", "in/b/c/walk.pkl"):
        motions.pickle(motions.raw(20), name)
    done = convert(tmp_path / "in", tmp_path / "out", ConvertConfig("g1_csv"))
    names = sorted(os.listdir(tmp_path / "out"))
    assert done.written == 5 and len({name.casefold() for name in names}) == 6
    assert {"LICENCES.csv", "a_LICENCES.csv", "Walk.csv", "b_walk.csv", "c_walk.csv", "c_walk_2.csv"} == set(names)
    assert {row["file"] for row in rows_of(tmp_path / "out")} == set(names) - {LICENCES}
