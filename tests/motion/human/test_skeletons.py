"""A person is found in any skeleton by its tree and bones, with names as evidence; what stays open is asked for."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bumblebee.motion.human.bvh import MAX_BYTES
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.human.read import read_human
from bumblebee.motion.human.roles import find_roles
from bumblebee.motion.human.skeleton import UnknownSkeleton
from bumblebee.motion.human.words import side_of, weight
from bumblebee.motion.reading.walk import motion_sources
from bumblebee.motion.retarget.retarget import retarget
from tests.motion.human.layouts import LAYOUTS, POINTS
from tests.motion.human.rigs import Z_UP, Rig, chains, write

PLAIN = "MotionBuilder"
DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "motions"
Joints = list[tuple[str, str, str]]


def read(joints: Joints, **rig: object) -> HumanMotion:
    (motion,) = read_human(Path("a.bvh"), write(joints, Rig(**rig)).encode())
    return motion


def refusal(joints: Joints) -> UnknownSkeleton:
    with pytest.raises(UnknownSkeleton) as caught:
        read(joints)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 900
    return caught.value


def unnamed(joints: Joints) -> Joints:
    named = {name: f"joint{n}" for n, (name, _, _) in enumerate(joints) if name != "end"}
    return [(named.get(name, name), named.get(parent, parent), point) for name, parent, point in joints]


def renamed(joints: Joints, change) -> Joints:
    return [(name if name == "end" else change(name), change(parent) if parent else "", point)
            for name, parent, point in joints]  # fmt: skip


def points(motion: HumanMotion, joints: Joints) -> list[str]:
    """The person's points in which the landmarks lie; an end of a chain is the point behind its joint's."""
    at = {name: point for name, _, point in joints} | {f"{parent}/end": point for _, parent, point in joints}
    return [at[role.joint] for role in motion.skeleton]


@cache
def plain() -> HumanMotion:
    return read(LAYOUTS[PLAIN])


def distances(motion: HumanMotion) -> np.ndarray:
    return np.linalg.norm(motion.positions[:, :, None] - motion.positions[:, None], axis=-1)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_skeletons_of_the_field_give_the_same_person(layout):
    motion = read(LAYOUTS[layout])
    assert points(motion, LAYOUTS[layout]) == list(POINTS)
    np.testing.assert_allclose(motion.positions, plain().positions, atol=1e-8)
    assert motion.notes[0].startswith("skeleton: by name") and "left and right" not in motion.notes[0]


@pytest.mark.parametrize("layout", ["Bandai Namco", "SOMA, BONES-SEED", "mocopi", "3ds Max Biped"])
def test_the_robots_motion_is_that_of_the_plain_skeleton(layout):
    ours, theirs = (retarget(motion, 50.0) for motion in (read(LAYOUTS[layout]), plain()))
    np.testing.assert_allclose(ours.joint_pos, theirs.joint_pos, atol=1e-3)
    np.testing.assert_allclose(ours.root_pos, theirs.root_pos, atol=1e-3)


@pytest.mark.parametrize("change", ["mixamorig:{}", "mixamorig{}", "Character1_{}", "model:rig:{}", "armature_{}"])
@pytest.mark.parametrize("case", [str, str.upper, str.lower])
def test_prefixes_and_cases_do_not_matter(change, case):
    joints = renamed(LAYOUTS["LAFAN1"], lambda name: case(change.format(name)))
    assert points(motion := read(joints), joints) == list(POINTS)
    assert motion.notes[0] == "skeleton: by name"


@pytest.mark.parametrize("layout", ["Bandai Namco", "CMU, 31 joints", "mocopi", "Noitom"])
def test_without_any_name_that_says_something_the_body_tells(layout):
    joints = unnamed(LAYOUTS[layout])
    motion = read(joints)
    assert points(motion, joints) == list(POINTS)
    assert "left_hip joint" in motion.notes[0] and "left and right by knees and toes" in motion.notes[0]


@pytest.mark.parametrize("rest", ["T", "down", "line"])
@pytest.mark.parametrize(("axes", "facing"), [("y", 90), ("y", 180), ("z", 0), ("z", 90)])
def test_neither_pose_at_rest_nor_axes_heading_unit_or_channels_matter(rest, axes, facing):
    heading = Rotation.from_euler("y", facing, degrees=True)
    world = Z_UP * heading if axes == "z" else heading
    for joints in (LAYOUTS["Bandai Namco"], unnamed(LAYOUTS["LAFAN1"])):
        for scale, order, positions in ((100, "ZXY", False), (1 / 0.0254, "XYZ", True)):
            motion = read(joints, rest=rest, world=world, scale=scale, order=order, positions=positions)
            assert points(motion, joints) == list(POINTS)
            np.testing.assert_allclose(distances(motion), distances(plain()), atol=1e-6)


def test_props_fingers_twist_bones_tails_and_further_roots_are_passed_over():
    more = chains("Reference=Ground, Trajectory=Ground, Hips=Hips, Spine=Spine, Spine1=Chest, Neck=Neck, Head=Head, "
        "HeadEnd=HeadEnd", "Head: {}Eye=Eye, end=HeadEnd", "Spine1: {}Shoulder=Collar, {}Arm=Arm, {}ArmRoll=MidArm, "
        "{}ForeArm=ForeArm, {}ForeArmTwist1=MidForeArm, {}Hand=Hand, {}HandMiddle1=Finger, end=FingerEnd",
        "{}Hand: {}HandThumb1=Thumb, end=ThumbEnd", "RightHand: Sword=RSword, end=RSword", "Spine1: Backpack=Pack, "
        "end=Pack", "Hips: Tail=Tail, Tail1=Pack, end=Pack", "Hips: {}UpLeg=UpLeg, {}UpLegTwist=MidUpLeg, {}Leg=Leg, "
        "{}Foot=Foot, {}ToeBase=Toe, end=ToeEnd", "{}Foot: {}Heel=Heel, end=Heel")  # fmt: skip
    motion = read(more)
    assert points(motion, more) == list(POINTS) and motion.notes[0] == "skeleton: by name"


def swapped(joints: Joints) -> Joints:
    """A skeleton on which the joints named left are on the right."""
    return [(name, parent, {"L": "R", "R": "L"}.get(point[0], point[0]) + point[1:] if point[1:2].isupper() else point)
            for name, parent, point in joints]  # fmt: skip


def test_names_that_are_left_on_the_right_are_asked_for():
    error = refusal(swapped(LAYOUTS[PLAIN]))
    assert "toes that point backwards: left and right exchanged" in str(error) and "--skeleton FILE" in str(error)
    assert [role.joint for role in error.roles][1] == "LeftUpLeg"


def test_sides_without_names_are_asked_for_where_knees_and_toes_disagree():
    heels = [
        (name, parent, point.replace("ToeEnd", "Heel").replace("Toe", "Heel"))
        for name, parent, point in unnamed(LAYOUTS[PLAIN])
    ]
    assert "they tell left from right, came neither" in str(refusal(heels))


ANIMAL = chains("Root=Hips, Spine1=Spine, Spine2=Chest, Neck=Neck, Head=Head, end=HeadEnd", "Root: Tail=Tail, end=Pack",
    "Spine2: {}Scapula=Collar, {}UpperArm=Arm, {}ForeLeg=ForeArm, {}FrontPaw=Hand, end=FingerEnd",
    "Root: {}Thigh=UpLeg, {}Shin=Leg, {}Hock=Foot, {}HindPaw=Toe, end=ToeEnd")  # fmt: skip


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (ANIMAL, "names against the shape: LeftForeLeg as left_elbow"),
        (chains("Wrist=LHand, Index=LFinger, end=LFingerEnd", "Wrist: Thumb=LThumb, end=LThumbEnd"), "without legs"),
        ([j for j in LAYOUTS[PLAIN] if "Toe" not in j[0] and "Toe" not in j[2]], "none for left_toe, right_toe"),
        ([j for j in LAYOUTS[PLAIN] if "Arm" not in f"{j[0]}{j[1]}" and "Hand" not in f"{j[0]}{j[1]}"], "none for"),
        ([j for j in LAYOUTS[PLAIN] if j[0] != "Head" and j[1] != "Head"], "none for head ("),
        (renamed(LAYOUTS[PLAIN], lambda name: name.replace("LeftLeg", "LeftWrist")), "LeftWrist as left_knee"),
    ],
)  # fmt: skip
def test_what_is_no_person_or_lacks_a_joint_is_asked_for_in_one_line(joints, words):
    error = refusal(joints)
    assert words in str(error) and "`bumblebee motions inspect` prints the file" in str(error)
    assert len(error.roles) == len(POINTS)


def test_words_and_sides():
    assert weight("knee", "leftleg") == weight("hip", "leftleg") == 1 and weight("hip", "leftupleg") == 2
    assert weight("wrist", "leftforearm") < 0 and weight("wrist", "joint7") == 0
    assert side_of("leftarm", "rightarm") == side_of("thighl", "thighr") == side_of("bip01lfoot", "bip01rfoot") == 1
    assert side_of("rshin", "lshin") == -1 and side_of("joint1", "joint2") == side_of("leftarm", "rightleg") == 0


def test_a_skeleton_as_large_as_any_that_is_read_ends_soon():
    count = 1000
    star, chain = [-1, *[0] * (count - 1)], list(range(-1, count - 1))
    forks = [-1, *[(n - 1) // 2 for n in range(1, count)]]
    for parents in (star, chain, forks):
        find_roles([f"LeftHip{n}" for n in range(count)], parents, np.ones((count, 3)))


@pytest.mark.skipif(not DATA.is_dir(), reason="the shared motions are not here")
def test_every_shared_skeleton_is_named_and_its_landmarks_are_the_known_ones():
    chest = {"Hips": ("Spine1", "Chest2"), "hip": ("chest",)}
    for source in [*motion_sources(DATA / "cmu_bvh.zip")][::9]:
        (motion,) = read_human(source.path, source.read(MAX_BYTES))
        joint = {role.landmark: role.joint for role in motion.skeleton}
        assert joint["chest"] in chest[joint["pelvis"]]
        assert joint["left_hip"] in ("LeftUpLeg", "LeftHip", "lThigh") and joint["neck"] in ("Neck1", "Neck", "neck")
