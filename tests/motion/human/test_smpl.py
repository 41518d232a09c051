"""SMPL motions: every version of AMASS's arrays, the body model where it is there, one line for what is wrong."""

import io
import os
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats import safe_pickle
from bumblebee.motion.human.forward import axis_angle_positions
from bumblebee.motion.human.npz import npz_keys
from bumblebee.motion.human.smpl import RATES, is_smpl, read_smpl
from bumblebee.motion.human.smpl_body import PARENTS
from tests.motion.human.people import npz, smpl

FILE = Path("a.npz")
DATA = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "motions"


@pytest.fixture(autouse=True)
def no_model(monkeypatch):
    monkeypatch.delenv("SMPL_MODEL_DIR", raising=False)


def model_arrays(count: int = 30, joints: int = 24) -> dict[str, np.ndarray]:
    """A body of 30 points; the last joints are not of the 22."""
    rng = np.random.default_rng(3)
    regressor = rng.random((joints, count))
    return {"J_regressor": regressor / regressor.sum(axis=1, keepdims=True), "v_template": rng.normal(size=(count, 3)),
            "shapedirs": rng.normal(size=(count, 3, 10))}  # fmt: skip


@pytest.mark.parametrize("width", [72, 156, 165])
def test_a_person_who_stands_is_1_m_70_high_whatever_the_model(width):
    found = read_smpl(FILE, npz(smpl(width=width)))
    head, toe = found.positions[0, 11], found.positions[0, 4]
    assert 1.4 < head[2] - toe[2] < 1.65 and toe[1] < found.positions[0, 3, 1]
    assert found.positions[0, 1, 0] > 0.05 > -0.05 > found.positions[0, 5, 0]


@pytest.mark.parametrize("name", RATES)
def test_the_frame_rate_has_several_names(name):
    arrays = smpl(**{"mocap_framerate": None, name: np.array(59.94)})
    assert read_smpl(FILE, npz(arrays)).fps == pytest.approx(59.94)


def test_a_file_without_a_frame_rate_asks_for_it():
    data = npz(smpl(mocap_framerate=None))
    with pytest.raises(BadInput, match=r"motions\.read\.smpl_fps"):
        read_smpl(FILE, data)
    found = read_smpl(FILE, data, fps=30.0)
    assert found.fps == 30 and "30 Hz, as the settings say" in found.notes


def test_split_poses_are_those_in_one_array():
    arrays = smpl(width=165, surface_model_type="smplx")
    arrays["poses"][:, 3:66] = np.random.default_rng(0).normal(scale=0.3, size=(40, 63))
    split = {**arrays, "root_orient": arrays["poses"][:, :3], "pose_body": arrays["poses"][:, 3:66]}
    split.pop("poses")
    whole, parts = read_smpl(FILE, npz(arrays)), read_smpl(FILE, npz(split))
    np.testing.assert_allclose(whole.positions, parts.positions)
    assert "SMPLX" in parts.notes[0]


def test_a_shape_that_cannot_be_applied_is_noted():
    found = read_smpl(FILE, npz(smpl(betas=np.ones(16))))
    assert "the person's shape (betas) is not applied: SMPL_MODEL_DIR is not set" in found.notes
    assert not any("betas" in note for note in read_smpl(FILE, npz(smpl())).notes)


def write_model(folder: Path, arrays: dict[str, np.ndarray], name: str = "SMPL_NEUTRAL.npz") -> None:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(npz(arrays) if name.endswith(".npz") else pickle.dumps(arrays))


@pytest.mark.parametrize(
    ("name", "gender", "width"),
    [
        ("SMPL_NEUTRAL.npz", "neutral", 72),
        ("smpl/SMPL_FEMALE.npz", b"female", 72),
        ("smpl/SMPL_MALE.pkl", "male", 72),
        ("smplh/male/model.npz", "male", 156),
        ("smplh/SMPLH_FEMALE.pkl", "female", 156),
        ("smplx/SMPLX_NEUTRAL.npz", "neutral", 165),
        ("models/smplx/SMPLX_MALE.npz", "Male", 165),
    ],
)
def test_with_the_body_model_the_joints_follow_from_the_shape(tmp_path, monkeypatch, name, gender, width):
    model, betas = model_arrays(), np.linspace(-1, 1, 10)
    write_model(tmp_path, model, name)
    monkeypatch.setenv("SMPL_MODEL_DIR", str(tmp_path))
    found = read_smpl(FILE, npz(smpl(width=width, gender=np.array(gender), betas=betas, poses=np.zeros((40, width)))))
    joints = model["J_regressor"] @ (model["v_template"] + model["shapedirs"] @ betas)
    np.testing.assert_allclose(found.positions[0, 4], joints[10] + [0, 0, 0.91], atol=1e-6)
    assert f"joints from {Path(name).name} and the person's betas" in found.notes


def test_of_another_gender_no_shape_is_taken(tmp_path, monkeypatch):
    write_model(tmp_path, model_arrays(), "SMPL_MALE.npz")
    monkeypatch.setenv("SMPL_MODEL_DIR", str(tmp_path))
    found = read_smpl(FILE, npz(smpl(gender="female", betas=np.ones(10))))
    assert any("no SMPL model of gender female" in note for note in found.notes)


class Chumpy:
    def __reduce__(self):
        return os.system, ("exit 1",)


def test_the_official_pickle_is_refused_unexecuted_with_what_to_do(tmp_path, monkeypatch):
    (tmp_path / "SMPL_NEUTRAL.pkl").write_bytes(pickle.dumps({"shapedirs": Chumpy()}))
    monkeypatch.setenv("SMPL_MODEL_DIR", str(tmp_path))
    with pytest.raises(BadInput, match=r"Convert it to \.npz") as caught:
        read_smpl(FILE, npz(smpl()))
    assert "Nothing of it was executed" in str(caught.value)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"v_template": np.zeros((30, 2))}, "expected J_regressor"),
        ({"J_regressor": np.zeros((21, 30))}, "expected J_regressor"),
        ({"shapedirs": np.zeros((30, 3))}, "expected J_regressor"),
        ({"shapedirs": np.array(["x"])}, "real numbers"),
    ],
)
def test_a_model_of_wrong_shapes_is_one_line(tmp_path, monkeypatch, changed, words):
    write_model(tmp_path, {**model_arrays(), **changed})
    monkeypatch.setenv("SMPL_MODEL_DIR", str(tmp_path))
    with pytest.raises(BadInput, match=words):
        read_smpl(FILE, npz(smpl()))


def test_pickled_objects_beside_the_motion_are_left_alone():
    stream = io.BytesIO()
    np.savez(stream, **smpl(), labels=np.array([{"a": 1}, None], dtype=object), allow_pickle=True)
    assert len(read_smpl(FILE, stream.getvalue()).positions) == 40


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"poses": np.zeros((40, 63))}, "a.npz: poses: expected an array of 72 or 156 or 165 columns, came shape"),
        ({"poses": np.zeros(72)}, "came shape (72,)"),
        ({"poses": np.full((40, 72), np.nan)}, "a.npz: poses, row 0: expected finite numbers"),
        ({"poses": np.full((40, 72), "x")}, "came text"),
        ({"poses": np.zeros((0, 72)), "trans": np.zeros((0, 3))}, "expected 1 to 500,000 frames, came 0"),
        ({"poses": np.array([None] * 72, dtype=object)}, "pickled objects"),
        ({"trans": np.zeros((39, 3))}, "as many frames in poses and trans, came 40 and 39"),
        ({"trans": np.zeros((40, 2))}, "an array of 3 columns"),
        ({"trans": np.full((40, 3), np.inf)}, "trans, row 0"),
        ({"betas": np.zeros((2, 3, 4))}, "betas: expected a row"),
        ({"betas": np.full(10, np.nan)}, "betas, row 0"),
        ({"mocap_framerate": 0}, "from 1 to 1000, came 0"),
        ({"mocap_framerate": np.nan}, "came nan"),
        ({"mocap_framerate": "fast"}, "from 1 to 1000, came shape"),
        ({"mocap_framerate": np.ones(3)}, "came shape (3,)"),
    ],
)
def test_what_is_wrong_is_one_line(changed, words):
    with pytest.raises(BadInput) as caught:
        read_smpl(FILE, npz(smpl(**changed)))
    assert words in str(caught.value) and str(caught.value).isprintable()


def test_a_truncated_file_is_one_line():
    whole = npz(smpl())
    for length in range(0, len(whole), len(whole) // 50):
        with pytest.raises(BadInput, match=r"a whole \.npz file"):
            read_smpl(FILE, whole[:length])


def test_a_file_is_known_by_the_names_of_its_arrays_alone():
    assert is_smpl(npz_keys(FILE, npz(smpl())))
    assert not is_smpl(npz_keys(FILE, npz({"joint_pos": np.zeros(1), "body_pos_w": np.zeros(1), "fps": np.zeros(1)})))
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("poses.npy", b"no array")
        archive.writestr("trans.npy", b"none either")
    assert is_smpl(npz_keys(FILE, stream.getvalue()))


@pytest.mark.skipif(not DATA.is_dir(), reason="the shared motions are not here")
def test_the_kinematics_are_those_of_asap_to_a_hundredth_of_a_millimetre():
    """ASAP's files hold the joints of a body of another shape: with its bones, taken from one frame, all agree."""
    for name in ("walk_level1", "kick_level3", "jump_degree_level5"):
        motion = next(iter(safe_pickle.load(DATA / "asap_g1" / f"{name}.pkl").values()))
        joints = motion["smpl_joints"][:, : len(PARENTS)].astype(float)
        with np.load(DATA / "asap_smpl" / f"{name}.npz") as file:
            angles = file["poses"].reshape(-1, 24, 3)[:, : len(PARENTS)].astype(float)
        bones = np.zeros((len(PARENTS), 3))
        for joint, parent in list(enumerate(PARENTS))[1:]:
            # The bone that brings the first frame's joint where ASAP has it: solved through the kinematics themselves.
            basis = np.stack([_moved(angles[:1], joint, axis) for axis in range(3)], axis=1)
            bones[joint] = np.linalg.solve(basis, joints[0, joint] - joints[0, parent])
        ours = axis_angle_positions(joints[:, 0], angles, bones, PARENTS)
        assert np.abs(ours - joints).max() < 1e-5


def _moved(angles: np.ndarray, joint: int, axis: int) -> np.ndarray:
    """By how much a joint moves where its bone grows by 1 along an axis, in one frame."""
    bones = np.zeros((len(PARENTS), 3))
    bones[joint, axis] = 1
    return axis_angle_positions(np.zeros((1, 3)), angles, bones, PARENTS)[0, joint]
