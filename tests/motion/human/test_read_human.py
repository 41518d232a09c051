"""Files of human motion become landmarks in metres with z up; what a file does not say is found and noted, or asked."""

from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.human.floor import floor_height
from bumblebee.motion.human.frame import require_right_handed, upright_axis, z_up
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.human.read import HumanConfig, read_human
from bumblebee.motion.reading.walk import motion_sources
from bumblebee.ranges import Unfit
from tests.motion.human.people import bvh, npz, rows, smpl

ROOT = Path(__file__).resolve().parents[3]
DATA = ROOT.parent / "shared" / "data" / "motions"


def read(text: str, **options: object) -> HumanMotion:
    (motion,) = read_human(Path("folder/a.bvh"), text.encode(), HumanConfig(**options))
    return motion


def line(read_it) -> str:
    with pytest.raises(BadInput) as caught:
        read_it()
    assert str(caught.value).isprintable()
    return str(caught.value)


@pytest.mark.parametrize(
    ("unit", "scale"), [("m", 1), ("dm", 10), ("cm", 100), ("mm", 1000), ("inch", 1 / 0.0254), ("cmu", 0.45 / 0.0254)]
)
def test_the_unit_is_found_by_the_legs_and_noted(unit, scale):
    motion = read(bvh(scale=scale))
    assert any(note.startswith(f"unit {unit}, by legs of") for note in motion.notes)
    assert motion.landmark("left_hip")[0] - motion.landmark("left_ankle")[0] == pytest.approx([0, 0, 0.84], abs=1e-4)
    assert motion.fps == 120 and motion.name == "a" and len(motion.positions) == 40


def test_a_body_of_no_size_is_asked_for_its_unit_and_a_stated_unit_is_held_to_it():
    assert "which none would explain" in line(lambda: read(bvh(scale=60)))
    assert read(bvh(scale=60), unit="cm").landmark("head")[0, 2] == pytest.approx(0.6 * (0.96 + 0.65), abs=0.1)
    assert "legs of 50.4 m with the unit m" in line(lambda: read(bvh(scale=60), unit="m"))


@pytest.mark.parametrize("turned", [False, True])
def test_up_is_found_by_the_body_and_left_stays_left(turned):
    motion = read(bvh(turned=turned))
    assert any(note.startswith(f"{'z' if turned else 'y'} is up") for note in motion.notes)
    assert motion.landmark("head")[0, 2] == pytest.approx(0.96 + 0.65)
    # Faces against y in both: left is at +x.
    assert motion.landmark("left_hip")[0, 0] > 0.09 and motion.landmark("left_toe")[0, 1] < -0.1


def lying(frames: int = 40) -> np.ndarray:
    values = rows(frames)
    values[:, 1], values[:, 5] = 10, 90  # turned about x: the head along z
    return values


def test_a_person_who_lies_is_asked_for_the_up_axis():
    words = line(lambda: read(bvh(values=lying())))
    assert "along z by the motion, along y by the skeleton's own pose. Say it: --set up=y or --set up=z" in words
    assert np.ptp(read(bvh(values=lying()), up="y").positions[0, :, 2]) < 0.6


def test_a_body_with_left_and_right_exchanged_is_refused():
    names = {f"{a}{name}": f"{b}{name}" for a, b in (("Left", "Right"), ("Right", "Left"))
             for name in ("UpLeg", "Leg", "Foot", "ToeBase", "Shoulder", "Arm", "ForeArm", "Hand")}  # fmt: skip
    assert "toes that point backwards" in line(lambda: read(bvh(names=names)))


@pytest.mark.parametrize("odd", [0, 3])
def test_a_t_pose_before_the_motion_is_cut_and_noted(odd):
    whole = rows(60)
    pose = whole[: 1 + odd].copy()
    pose[:, 6:] = 0
    motion = read(bvh(values=np.concatenate([pose, whole])))
    assert motion.first_row == 2 + odd and len(motion.positions) == 60
    assert any(note.startswith(f"{1 + odd} frame") and "at the start cut" in note for note in motion.notes)
    np.testing.assert_allclose(motion.positions, read(bvh(values=whole)).positions, atol=1e-5)
    assert motion.row(0) == f"frame {2 + odd}"


@pytest.mark.parametrize("fps", [30.0, 120.0])
@pytest.mark.parametrize(("column", "off"), [(0, 50), (1, -30), (4, 90)])  # aside, below [cm], turned [degrees]
def test_a_first_frame_that_is_elsewhere_is_cut_and_noted(fps, column, off):
    whole = rows(60)
    bad = whole[:1].copy()
    bad[0, column] += off
    motion = read(bvh(values=np.concatenate([bad, whole]), fps=fps))
    assert motion.first_row == 2 and any(note.startswith("1 frame at the start cut: ") for note in motion.notes)
    np.testing.assert_allclose(motion.positions, read(bvh(values=whole, fps=fps)).positions, atol=1e-5)


def test_a_motion_that_starts_with_level_arms_or_that_stops_from_a_run_is_kept():
    slow = rows(60)
    slow[:, 6:] *= np.linspace(0, 1, 60)[:, None]
    assert read(bvh(values=slow)).first_row == 1
    stops = rows(120)
    seconds = np.minimum(np.arange(120) / 30, 0.8)
    stops[:, 0] = 100 * (8 * seconds - 5 * seconds**2)  # 8 m/s, at rest after 0.8 s
    assert read(bvh(values=stops, fps=30)).first_row == 1


@pytest.mark.parametrize("height", [-0.2, 0.0, 0.5])
def test_a_floor_that_is_not_at_zero_is_moved_there_and_noted(height):
    values = rows(80)
    values[:, 1] += 100 * height
    motion = read(bvh(values=values))
    assert motion.landmark("left_ankle")[:, 2].min() == pytest.approx(0.07, abs=1e-4)
    assert any("the floor was at" in note for note in motion.notes) == (height != 0)


def test_neither_a_jump_nor_a_slow_drift_moves_the_floor():
    values = rows(200)
    values[50:100, 1] += 40 * np.sin(np.linspace(0, np.pi, 50))
    np.testing.assert_allclose(
        read(bvh(values=values)).positions[0], read(bvh(values=rows(200))).positions[0], atol=1e-4
    )
    values = rows(200)
    values[:, 1] += np.linspace(0, 10, 200)
    assert np.ptp(read(bvh(values=values)).landmark("left_ankle")[:, 2]) == pytest.approx(0.1, abs=1e-3)


def test_a_fall_from_above_has_no_floor_and_is_left_where_it_is():
    values = rows(60)
    values[:, 1] += np.linspace(500, 300, 60)
    motion = read(bvh(values=values))
    assert motion.positions[0, 0, 2] > 5 and any("no foot stands" in note for note in motion.notes)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (bvh(frames=1), "a motion of at least 2 frames"),
        (bvh(names={"LeftLeg": "LeftWrist"}), "LeftWrist as left_knee"),
        (bvh(values=rows(40) + np.eye(1, rows(40).shape[1]) * 1e6), "within 1000 m"),
    ],
)
def test_what_cannot_be_used_is_one_line(text, words):
    assert words in line(lambda: read(text))


def test_an_npz_of_something_else_is_one_line():
    data = npz({"joint_pos": np.zeros((3, 23))})
    assert "poses and trans" in line(lambda: read_human(Path("a.npz"), data))


def test_settings_hold_their_ranges():
    for wrong in ({"unit": "yard"}, {"up": "w"}, {"fps": -1.0}):
        with pytest.raises(Unfit):
            HumanConfig(**wrong)


def test_an_smpl_file_that_looks_y_up_is_asked_for_its_axis():
    arrays = smpl()
    arrays["poses"][:, 0], arrays["trans"] = 0, np.tile([0.0, 1.15, 0.0], (40, 1))
    words = line(lambda: read_human(Path("a.npz"), npz(arrays)))
    assert "stands along y: another axis is up, or the person lies" in words and "motions.read.up" in words
    (turned,) = read_human(Path("a.npz"), npz(arrays), HumanConfig(up="y"))
    assert turned.landmark("head")[0, 2] > 1.3
    (lies,) = read_human(Path("a.npz"), npz(arrays), HumanConfig(up="z"))
    assert np.ptp(lies.positions[0, :, 2]) < 0.6


TURNS = {"x": (2, 1, 0, (1, 1, -1)), "-x": (2, 1, 0, (-1, 1, 1)), "y": (0, 2, 1, (1, 1, -1)),
         "-y": (0, 2, 1, (1, -1, 1)), "-z": (0, 1, 2, (1, -1, -1))}  # fmt: skip


@pytest.mark.parametrize("up", TURNS)
def test_an_smpl_file_whose_person_does_not_stand_along_z_is_asked_for_and_read_as_set(up):
    positions = read_human(Path("a.npz"), npz(smpl()))[0].positions
    *columns, signs = TURNS[up]
    turned = positions[..., columns] * signs
    assert upright_axis(turned) == up and upright_axis(turned[:1]) == up
    np.testing.assert_allclose(np.linalg.norm(np.diff(z_up(turned, up), axis=1), axis=2),
                               np.linalg.norm(np.diff(positions, axis=1), axis=2), atol=1e-9)  # fmt: skip
    assert upright_axis(z_up(turned, up)) == "z"
    require_right_handed("a turn is no mirror", z_up(turned, up))


def test_a_person_with_the_trunk_held_level_still_stands():
    positions = read_human(Path("a.npz"), npz(smpl()))[0].positions.copy()
    trunk = [LANDMARKS.index(name) for name in ("chest", "neck", "head")]
    positions[:, trunk] = positions[:, trunk][..., [2, 1, 0]] + [0.0, 0.0, 0.9]
    positions[:, LANDMARKS.index("left_ankle")] += [0.0, 0.5, 0.7]  # lifted behind, and moved
    positions[::2, LANDMARKS.index("left_ankle"), 0] += 0.02
    assert upright_axis(positions) == "z"


@pytest.mark.skipif(not DATA.is_dir(), reason="the shared motions are not here")
def test_every_shared_motion_of_a_person_is_read_at_the_size_of_one():
    sources = [*motion_sources(DATA / "cmu_bvh.zip"), *motion_sources(DATA / "asap_smpl")]
    units: dict[str, int] = {}
    for source in sources[::7]:
        (motion,) = read_human(source.path, source.read(1 << 28))
        legs = np.linalg.norm(np.diff(motion.positions[:, 1:4], axis=1), axis=2).sum(axis=1)
        assert legs.min() > 0.75 and legs.max() < 0.9
        assert motion.fps == (30 if source.path.suffix == ".npz" else 120)
        assert floor_height(motion.positions, motion.fps) == pytest.approx(0, abs=0.0101)
        unit = next((note.split(",")[0] for note in motion.notes if note.startswith("unit")), "m")
        units[unit] = units.get(unit, 0) + 1
    assert len(sources) == 157 and set(units) == {"unit cmu", "unit cm", "m"}
