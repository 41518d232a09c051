"""Landmarks are found by name, whatever program wrote the skeleton; a skeleton without match says what is missing."""

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.human.landmarks import TABLES, find_landmarks
from bumblebee.motion.human.motion import LANDMARKS

CMU31 = """Hips LHipJoint LeftUpLeg LeftLeg LeftFoot LeftToeBase LeftToeBase/end RHipJoint RightUpLeg RightLeg RightFoot
RightToeBase RightToeBase/end LowerBack Spine Spine1 Neck Neck1 Head Head/end LeftShoulder LeftArm LeftForeArm LeftHand
LeftFingerBase LeftHandIndex1 LThumb RightShoulder RightArm RightForeArm RightHand RightFingerBase RThumb"""
CMU131 = """Hips LHipJoint LeftHip LeftKnee LeftAnkle LeftToe RHipJoint RightHip RightKnee RightAnkle RightToe lowerback
Chest Chest2 lowerneck Neck Head LeftCollar LeftShoulder LeftElbow LeftWrist lhand RightCollar RightShoulder RightElbow
RightWrist rhand"""
CMU43 = """hip abdomen chest neck head leftEye rightEye rCollar rShldr rForeArm rHand lCollar lShldr lForeArm lHand
rButtock rThigh rShin rFoot rFoot/end lButtock lThigh lShin lFoot lFoot/end"""
LAFAN1 = """Hips LeftUpLeg LeftLeg LeftFoot LeftToe RightUpLeg RightLeg RightFoot RightToe Spine Spine1 Spine2 Neck Head
LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder RightArm RightForeArm RightHand"""
BIPED = """Bip01|Bip01 Pelvis|Bip01 Spine|Bip01 Spine1|Bip01 Neck|Bip01 Head|Bip01 L Clavicle|Bip01 L UpperArm|
Bip01 L Forearm|Bip01 L Hand|Bip01 R UpperArm|Bip01 R Forearm|Bip01 R Hand|Bip01 L Thigh|Bip01 L Calf|Bip01 L Foot|
Bip01 L Toe0|Bip01 R Thigh|Bip01 R Calf|Bip01 R Foot|Bip01 R Toe0"""
UNREAL = """root pelvis spine_01 spine_02 spine_03 neck_01 head clavicle_l upperarm_l lowerarm_l hand_l upperarm_r
lowerarm_r hand_r thigh_l calf_l foot_l ball_l thigh_r calf_r foot_r ball_r"""
BIOVISION = """Hips Chest Neck Head Head/end LeftCollar LeftUpArm LeftLowArm LeftHand RightCollar RightUpArm RightLowArm
RightHand LeftUpLeg LeftLowLeg LeftFoot LeftFoot/end RightUpLeg RightLowLeg RightFoot RightFoot/end"""
UNITY = """Hips Spine Chest UpperChest Neck Head LeftShoulder LeftUpperArm LeftLowerArm LeftHand RightUpperArm
RightLowerArm RightHand LeftUpperLeg LeftLowerLeg LeftFoot LeftToes RightUpperLeg RightLowerLeg RightFoot RightToes"""
OPTITRACK = """S_Hip S_Ab S_Chest S_Neck S_Head S_LShoulder S_LUArm S_LFArm S_LHand S_RUArm S_RFArm S_RHand S_LThigh
S_LShin S_LFoot S_LToe S_RThigh S_RShin S_RFoot S_RToe"""
SMPL = """Pelvis L_Hip R_Hip Spine1 L_Knee R_Knee Spine2 L_Ankle R_Ankle Spine3 L_Foot R_Foot Neck L_Collar R_Collar
Head L_Shoulder R_Shoulder L_Elbow R_Elbow L_Wrist R_Wrist L_Hand R_Hand"""


def found(names: list[str], at_parent: tuple[str, ...] = ()) -> dict[str, str]:
    offsets = np.array([[0.0, 0.0, 0.0] if name in at_parent else [0.0, 1.0, 0.0] for name in names])
    joints, _ = find_landmarks("a.bvh", names, offsets)
    return {landmark: names[joint] for landmark, joint in zip(LANDMARKS, joints, strict=True)}


@pytest.mark.parametrize(
    ("names", "some"),
    [
        (CMU31, {"left_shoulder": "LeftArm", "chest": "Spine1", "right_toe": "RightToeBase"}),
        (CMU131, {"left_shoulder": "LeftShoulder", "left_hip": "LeftHip", "chest": "Chest2"}),
        (CMU43, {"left_shoulder": "lShldr", "right_knee": "rShin", "left_toe": "lFoot/end", "chest": "chest"}),
        (LAFAN1, {"left_toe": "LeftToe", "chest": "Spine2", "left_knee": "LeftLeg", "right_elbow": "RightForeArm"}),
        (UNREAL, {"left_toe": "ball_l", "chest": "spine_03", "pelvis": "pelvis", "right_hip": "thigh_r"}),
        (BIOVISION, {"left_toe": "LeftFoot/end", "chest": "Chest", "left_knee": "LeftLowLeg"}),
        (UNITY, {"left_toe": "LeftToes", "chest": "UpperChest", "left_shoulder": "LeftUpperArm"}),
        (OPTITRACK, {"left_toe": "S_LToe", "left_shoulder": "S_LUArm", "pelvis": "S_Hip"}),
        (SMPL, {"left_toe": "L_Foot", "chest": "Spine3", "left_shoulder": "L_Shoulder", "head": "Head"}),
        (SMPL.replace("L_", "left_").replace("R_", "right_"), {"left_toe": "left_Foot", "right_hip": "right_Hip"}),
    ],
)  # fmt: skip
def test_the_skeletons_of_the_field(names, some):
    assert found(names.split()).items() >= some.items()


def test_bipeds_names_have_spaces():
    names = [name.strip() for name in BIPED.split("|")]
    some = {"left_hip": "Bip01 L Thigh", "right_toe": "Bip01 R Toe0", "chest": "Bip01 Spine1"}
    assert found(names).items() >= some.items()


@pytest.mark.parametrize("change", ["mixamorig:{}", "mixamorig{}", "Character1_{}", "model:rig:{}", "{}"])
@pytest.mark.parametrize("case", [str, str.upper, str.lower])
def test_prefixes_and_cases_do_not_matter(change, case):
    names = [case(change.format(name)) for name in LAFAN1.split()]
    assert found(["Reference", *names])["left_toe"] == case(change.format("LeftToe"))


def test_a_neck_that_lies_on_the_chest_gives_way_to_the_next():
    assert found(CMU31.split(), at_parent=("Neck",))["neck"] == "Neck1"
    assert found(CMU31.split())["neck"] == "Neck"
    assert found(CMU131.split(), at_parent=("lowerneck",))["neck"] == "Neck"


def test_left_and_right_are_never_exchanged_in_the_tables():
    for table in TABLES:
        for landmark, names in table.names().items():
            if landmark.startswith("left_"):
                other = table.names()["right_" + landmark[5:]]
                assert len(names) == len(other) and not set(names) & set(other)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ([name for name in LAFAN1.split() if name not in ("Head", "LeftToe")], "none for left_toe, head"),
        (LAFAN1.replace("RightHand", "RightPaw").split(), "none for right_wrist"),
        ([*LAFAN1.split(), "Left_Foot"], "none for left_ankle"),
        (["root", "tail", "wing"], "a skeleton that is not known"),
        (["x" * 80] * 1000, "a skeleton that is not known"),
        ([f"{number}hip" for number in range(1000)], "none for left_hip"),
    ],
)
def test_a_skeleton_without_match_is_one_line_about_what_is_missing(names, words):
    with pytest.raises(BadInput) as caught:
        found(names)
    assert words in str(caught.value) and len(str(caught.value)) < 700
