"""ASAP pickles come back as they were written; what is missing or of the wrong shape is named."""

import joblib
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.asap_pickle import read_asap_pickle
from bumblebee.robot.facts import joint_names


@pytest.mark.parametrize("compress", [0, 3])
def test_round_trip(motions, compress):
    raw = motions.raw()
    (came,) = read_asap_pickle(motions.pickle(raw, compress=compress))
    np.testing.assert_array_equal(came.root_pos, raw.root_pos.astype(np.float32))
    np.testing.assert_array_equal(came.root_quat, raw.root_quat)
    np.testing.assert_array_equal(came.joint_pos, raw.joint_pos.astype(np.float32))
    assert (came.name, came.fps) == ("sway", 30.0)


def test_a_file_may_hold_several_motions_or_one_bare(motions, tmp_path):
    long, short = motions.fields(motions.raw(40)), motions.fields(motions.raw(20))
    joblib.dump({"long": long, "short": short}, tmp_path / "two.pkl")
    assert [(m.name, len(m.root_pos)) for m in read_asap_pickle(tmp_path / "two.pkl")] == [
        ("two_long", 40),
        ("two_short", 20),
    ]
    joblib.dump(short, tmp_path / "bare.pkl")
    assert [m.name for m in read_asap_pickle(tmp_path / "bare.pkl")] == ["bare"]


def test_29_joints_lose_their_wrists(motions):
    raw = motions.raw()
    wide = np.full((len(raw.root_pos), 29), 9.0)
    for column, name in enumerate(joint_names()):
        wide[:, joint_names(every=True).index(name)] = raw.joint_pos[:, column]
    (came,) = read_asap_pickle(motions.pickle(raw, dof=wide))
    np.testing.assert_array_equal(came.joint_pos, raw.joint_pos)


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({"dof": np.zeros((80, 22))}, r"dof or dof_pos: expected an array of 23 or 29 columns, came shape \(80, 22\)"),
        ({"dof": [0.0]}, "dof or dof_pos: expected an array of 23 or 29 columns, came a list"),
        (
            {"root_rot": np.zeros((80, 3))},
            r"root_rot or root_quat: expected an array of 4 columns, came shape \(80, 3\)",
        ),
        ({"root_trans_offset": np.zeros((79, 3))}, "as many frames in root_trans_offset and root_rot, came 79 and 80"),
        ({"fps": 0}, "fps: expected a number of frames a second from 1 to 1000, came 0"),
        ({"fps": "30"}, "fps: expected .* came a str"),
        ({"fps": float("nan")}, "fps: expected .* came nan"),
    ],
)
def test_what_is_wrong_is_named(motions, changed, line):
    path = motions.pickle(motions.raw(), **changed)
    with pytest.raises(BadInput, match=line) as caught:
        read_asap_pickle(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_missing_field_is_named_with_those_that_are_there(motions, tmp_path):
    fields = motions.fields(motions.raw())
    fields = {"root_trans_offset": fields["root_trans_offset"], "dof_pos": np.zeros((80, 29)), "fps": 30}
    joblib.dump({"walk": fields}, tmp_path / "a.pkl")
    with pytest.raises(
        BadInput, match=r"root_rot or root_quat: expected .* came no such field among root_trans_offset, dof_pos, fps"
    ):
        read_asap_pickle(tmp_path / "a.pkl")


@pytest.mark.parametrize("content", [[], {}, 3, {"walk": 3}])
def test_a_pickle_of_something_else_is_said(tmp_path, content):
    joblib.dump(content, tmp_path / "a.pkl")
    with pytest.raises(BadInput, match=r"a\.pkl: expected a dict"):
        read_asap_pickle(tmp_path / "a.pkl")


def test_one_array_named_many_times_is_bounded(motions, tmp_path):
    fields = motions.fields(motions.raw(2000))
    joblib.dump({f"m{i}": fields for i in range(3000)}, tmp_path / "bomb.pkl")
    with pytest.raises(BadInput, match=r"at most .* frames in a file"):
        read_asap_pickle(tmp_path / "bomb.pkl")
