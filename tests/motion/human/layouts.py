"""Names and trees of the skeletons of the field, on the person of `rigs.py`; lengths and motions are made up."""

from tests.motion.human.rigs import chains

_LEG = "{}UpLeg=UpLeg, {}Leg=Leg, {}Foot=Foot, {}ToeBase=Toe, end=ToeEnd"
_ARM = "{}Shoulder=Collar, {}Arm=Arm, {}ForeArm=ForeArm, {}Hand=Hand, {}HandMiddle1=Finger, end=FingerEnd"
_THUMB = "{}Hand: {}HandThumb1=Thumb, end=ThumbEnd"
_XSENS = ("Hips=Hips, Chest=Spine, Chest2=S2, Chest3=S3, Chest4=Chest, Neck=Neck, Head=Head, end=HeadEnd",
          "Chest4: {}Collar=Collar, {}Shoulder=Arm, {}Elbow=ForeArm, {}Wrist=Hand, end=FingerEnd",
          "Hips: {}Hip=UpLeg, {}Knee=Leg, {}Ankle=Foot, {}Toe=Toe, end=ToeEnd")  # fmt: skip

LAYOUTS = {
    "MotionBuilder": chains("Hips=Hips, Spine=Spine, Spine1=S2, Spine2=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        f"Spine2: {_ARM}", f"Hips: {_LEG}"),
    "Mixamo": chains("m:Hips=Hips, m:Spine=Spine, m:Spine1=S2, m:Spine2=Chest, m:Neck=Neck, m:Head=Head, "
        "m:HeadTop_End=HeadEnd".replace("m:", "mixamorig:"),
        "mixamorig:Spine2: " + _ARM.replace("{}", "mixamorig:{}"), _THUMB.replace("{}", "mixamorig:{}"),
        "mixamorig:Hips: " + _LEG.replace("{}", "mixamorig:{}").replace("end=", "mixamorig:{}Toe_End=")),
    "LAFAN1": chains("Hips=Hips, Spine=Spine, Spine1=S2, Spine2=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        "Spine2: {}Shoulder=Collar, {}Arm=Arm, {}ForeArm=ForeArm, {}Hand=Hand, end=Finger",
        "Hips: {}UpLeg=UpLeg, {}Leg=Leg, {}Foot=Foot, {}Toe=Toe, end=ToeEnd"),
    "ZeroEGGS": chains("Hips=Hips, Spine=Spine, Spine1=S2, Spine2=S3, Spine3=Chest, Neck=Neck, Neck1=Neck2, Head=Head, "
        "HeadEnd=HeadEnd", f"Spine3: {_ARM}", _THUMB, f"Hips: {_LEG.replace('end=', '{}ToeBaseEnd=')}"),
    "Trinity, BEAT": chains("Hips=Hips, Spine=Spine, Spine1=S2, Spine2=S3, Spine3=Chest, Neck=Neck, Neck1=Neck2, "
        "Head=Head, HeadEnd=HeadEnd", f"Spine3: {_ARM}",
        "Hips: {}UpLeg=UpLeg, {}Leg=Leg, {}Foot=Foot, {}ForeFoot=ForeFoot, {}ToeBase=Toe, {}ToeBaseEnd=ToeEnd"),
    "fore foot alone": chains("Hips=Hips, Spine=Spine, Spine1=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        f"Spine1: {_ARM}", "Hips: {}UpLeg=UpLeg, {}Leg=Leg, {}Foot=Foot, {}ForeFoot=Toe, end=ToeEnd"),
    "Rokoko": chains("Hips=Hips, Spine1=Spine, Spine2=S2, Spine3=S3, Spine4=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        f"Spine4: {_ARM}", "Hips: {}Thigh=UpLeg, {}Shin=Leg, {}Foot=Foot, {}Toe=Toe, {}ToeTip=ToeEnd"),
    "Xsens, 100STYLE": chains(*_XSENS),
    "Noitom": chains("Hips=Hips, Spine=Spine, Spine1=S2, Spine2=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        "Spine2: {}Shoulder=Collar, {}Arm=Arm, {}ForeArm=ForeArm, {}Hand=Hand, {}InHandMiddle=Finger, "
        "{}HandMiddle1=FingerEnd", _THUMB, "Hips: {}UpLeg=UpLeg, {}Leg=Leg, {}Foot=Foot, end=Toe"),
    "mocopi": chains("root=Hips, torso_1=Spine, torso_2=S2, torso_3=S3, torso_4=Chest, neck_1=Neck, neck_2=Neck2, "
        "head=Head, end=HeadEnd", "torso_4: {}_shoulder=Collar, {}_up_arm=Arm, {}_low_arm=ForeArm, {}_hand=Hand, "
        "end=Finger", "root: {}_up_leg=UpLeg, {}_low_leg=Leg, {}_foot=Foot, {}_toes=Toe, end=ToeEnd", sides="l|r"),
    "3ds Max Biped": chains("Bip01=Hips, Bip01 Pelvis=Hips, Bip01 Spine=Spine, Bip01 Spine1=Chest, Bip01 Neck=Neck, "
        "Bip01 Head=Head, Bip01 HeadNub=HeadEnd", "Bip01 Neck: Bip01 {} Clavicle=Collar, Bip01 {} UpperArm=Arm, "
        "Bip01 {} Forearm=ForeArm, Bip01 {} Hand=Hand, Bip01 {} Finger0=Finger, Bip01 {} Finger0Nub=FingerEnd",
        "Bip01 Pelvis: Bip01 {} Thigh=UpLeg, Bip01 {} Calf=Leg, Bip01 {} Foot=Foot, Bip01 {} Toe0=Toe, "
        "Bip01 {} Toe0Nub=ToeEnd", sides="L|R"),
    "SOMA, BONES-SEED": chains("Root=Ground, Hips=Hips, Spine1=Spine, Spine2=S2, Chest=Chest, Neck1=Neck, Neck2=Neck2, "
        "Head=Head, HeadEnd=HeadEnd", "Head: Jaw=Eye, end=HeadEnd", f"Chest: {_ARM}", _THUMB,
        "Hips: {}Leg=UpLeg, {}Shin=Leg, {}Foot=Foot, {}ToeBase=Toe, {}ToeEnd=ToeEnd"),
    "Bandai Namco": chains("joint_Root=Ground, Hips=Hips, Spine=Spine, Chest=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        "Chest: Shoulder_{}=Collar, UpperArm_{}=Arm, LowerArm_{}=ForeArm, Hand_{}=Hand, end=Finger",
        "Hips: UpperLeg_{}=UpLeg, LowerLeg_{}=Leg, Foot_{}=Foot, Toes_{}=Toe, end=ToeEnd", sides="L|R"),
    "SMPL-X, Motion-X": chains("pelvis=Hips, spine1=Spine, spine2=S2, spine3=Chest, neck=Neck, head=Head, end=HeadEnd",
        "head: jaw=Eye, end=HeadEnd", "spine3: {}_collar=Collar, {}_shoulder=Arm, {}_elbow=ForeArm, {}_wrist=Hand, "
        "{}_middle1=Finger, end=FingerEnd", "pelvis: {}_hip=UpLeg, {}_knee=Leg, {}_ankle=Foot, {}_foot=Toe, end=ToeEnd",
        sides="left|right"),
    "CMU, 31 joints": chains("Hips=Hips, LowerBack=Hips, Spine=Spine, Spine1=Chest, Neck=Chest, Neck1=Neck, Head=Head, "
        "end=HeadEnd", "Spine1: {}Shoulder=Chest, {}Arm=Arm, {}ForeArm=ForeArm, {}Hand=Hand, {}FingerBase=Hand, "
        "{}HandIndex1=Finger, end=FingerEnd", f"Hips: {{}}HipJoint=Hips, {_LEG}"),
    "CMU, 43 joints, Poser": chains("hip=Hips, abdomen=Spine, chest=Chest, neck=Neck, head=Head, leftEye=Eye",
        "chest: {}Collar=Collar, {}Shldr=Arm, {}ForeArm=ForeArm, {}Hand=Hand, {}Mid1=Finger, end=FingerEnd",
        "hip: {}Buttock=Buttock, {}Thigh=UpLeg, {}Shin=Leg, {}Foot=Foot, end=Toe", sides="l|r"),
    "DAZ": chains("hip=Hips, abdomenLower=Spine, chestUpper=Chest, neckLower=Neck, head=Head, end=HeadEnd",
        "chestUpper: {}Collar=Collar, {}ShldrBend=Arm, {}ShldrTwist=MidArm, {}ForearmBend=ForeArm, "
        "{}ForearmTwist=MidForeArm, {}Hand=Hand, end=Finger", "hip: {}ThighBend=UpLeg, {}ThighTwist=MidUpLeg, "
        "{}Shin=Leg, {}Foot=Foot, {}Toe=Toe, end=ToeEnd", sides="l|r"),
    "Biovision": chains("Hips=Hips, Chest=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        "Chest: {}Collar=Collar, {}UpArm=Arm, {}LowArm=ForeArm, {}Hand=Hand, end=Finger",
        "Hips: {}UpLeg=UpLeg, {}LowLeg=Leg, {}Foot=Foot, end=Toe"),
    "Unity, VRM": chains("Hips=Hips, Spine=Spine, Chest=S2, UpperChest=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        "UpperChest: {}Shoulder=Collar, {}UpperArm=Arm, {}LowerArm=ForeArm, {}Hand=Hand, end=Finger",
        "Hips: {}UpperLeg=UpLeg, {}LowerLeg=Leg, {}Foot=Foot, {}Toes=Toe, end=ToeEnd"),
    "OptiTrack": chains("S_Hip=Hips, S_Ab=Spine, S_Chest=Chest, S_Neck=Neck, S_Head=Head, end=HeadEnd",
        "S_Chest: S_{}Shoulder=Collar, S_{}UArm=Arm, S_{}FArm=ForeArm, S_{}Hand=Hand, end=Finger",
        "S_Hip: S_{}Thigh=UpLeg, S_{}Shin=Leg, S_{}Foot=Foot, S_{}Toe=Toe, end=ToeEnd", sides="L|R"),
    "Unreal": chains("root=Ground, pelvis=Hips, spine_01=Spine, spine_02=S2, spine_03=Chest, neck_01=Neck, head=Head, "
        "end=HeadEnd", "spine_03: clavicle_{}=Collar, upperarm_{}=Arm, lowerarm_{}=ForeArm, hand_{}=Hand, "
        "middle_01_{}=Finger, end=FingerEnd", "upperarm_{}: upperarm_twist_01_{}=MidArm, end=ForeArm",
        "pelvis: thigh_{}=UpLeg, calf_{}=Leg, foot_{}=Foot, ball_{}=Toe, end=ToeEnd",
        "thigh_{}: thigh_twist_01_{}=MidUpLeg, end=Leg", sides="l|r"),
    "Blender": chains("spine=Hips, spine.001=Spine, spine.002=S2, spine.003=Chest, spine.004=Neck, spine.005=Neck2, "
        "spine.006=Head, end=HeadEnd", "spine.003: shoulder.{}=Collar, upper_arm.{}=Arm, forearm.{}=ForeArm, "
        "hand.{}=Hand, end=Finger", "spine: thigh.{}=UpLeg, shin.{}=Leg, foot.{}=Foot, toe.{}=Toe, end=ToeEnd",
        "foot.{}: heel.02.{}=Heel, end=Foot", sides="L|R"),
    "Kinect": chains("SpineBase=Hips, SpineMid=S2, SpineShoulder=Chest, Neck=Neck, Head=Head, end=HeadEnd",
        "SpineShoulder: Shoulder{}=Arm, Elbow{}=ForeArm, Wrist{}=Hand, Hand{}=Finger, end=FingerEnd",
        "SpineBase: Hip{}=UpLeg, Knee{}=Leg, Ankle{}=Foot, Foot{}=Toe, end=ToeEnd"),
}  # fmt: skip
POINTS = ("Hips", "LUpLeg", "LLeg", "LFoot", "LToe", "RUpLeg", "RLeg", "RFoot", "RToe", "Chest", "Neck", "Head", "LArm",
          "LForeArm", "LHand", "RArm", "RForeArm", "RHand")  # fmt: skip
"""The person's points in which `LANDMARKS` lie."""
