"""One function for all formats of robot motion: the suffix and what is inside decide; a rate is never invented."""

import io
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.read import RobotConfig, format_of, read_robot
from bumblebee.motion.reading.usable import usable

SHARED = next((p / "shared/data/motions" for p in Path(__file__).parents if (p / "shared/data/motions").is_dir()), None)


def test_a_csv_without_a_rate_is_asked_for_it(motions):
    path = motions.csv(motions.raw())
    with pytest.raises(BadInput, match=r"expected a frame rate, .*a sprint. Say it: --csv-fps 30") as caught:
        read_robot(path, path.read_bytes())
    assert "\n" not in str(caught.value)
    (came,) = read_robot(path, path.read_bytes(), RobotConfig(csv_fps=30))
    assert came.fps == 30 and came.rate_from == "setting"


def test_pickles_and_npz_of_the_same_fields_are_the_same_motion(motions):
    raw = motions.raw()
    path = motions.pickle(raw)
    (from_pickle,) = read_robot(path, path.read_bytes())
    stream = io.BytesIO()
    np.savez(stream, **motions.fields(raw))
    (from_npz,) = read_robot(Path("a.npz"), stream.getvalue())
    for name in ("root_pos", "root_quat", "joint_pos"):
        np.testing.assert_array_equal(getattr(from_pickle, name), getattr(from_npz, name))
    assert from_npz.fps == from_pickle.fps == 30


def test_another_suffix_is_refused():
    with pytest.raises(BadInput, match=r"expected a motion of the G1 \(\.csv, \.npz, \.pkl"):
        read_robot(Path("a.fbx"), b"")
    assert (format_of(Path("a.CSV")), format_of(Path("a.p")), format_of(Path("a"))) == ("G1 CSV", "pickle", "?")


@pytest.mark.parametrize(
    ("field", "value"), [("csv_fps", 0.0), ("csv_length", "inch"), ("csv_euler", "xxz"), ("npz_joints", "isaac")]
)
def test_settings_out_of_range_are_refused(field, value):
    with pytest.raises(BadInput, match=f"RobotConfig.{field}"):
        RobotConfig(**{field: value})


@pytest.mark.skipif(SHARED is None, reason="no shared motions beside the repository")
@pytest.mark.parametrize(("folder", "count", "suffix"), [("asap_g1", 51, ".pkl"), ("g1_moves", 59, ".csv")])
def test_real_motions_are_read_and_pass_the_checks(folder, count, suffix):
    paths = sorted((SHARED / folder).glob(f"*{suffix}"))
    assert len(paths) == count
    for path in paths[::7]:
        for raw in read_robot(path, path.read_bytes(), RobotConfig(csv_fps=60)):
            usable(raw)
            assert raw.notes == ()
