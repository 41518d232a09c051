"""A motion of the robot as a clip: with its texts, source, licence and keypoints, checked."""

from bumblebee.io.names import safe_stem
from bumblebee.motion.checks import check_clip
from bumblebee.motion.clip import Clip
from bumblebee.motion.describe.described import Described
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.file import File


def clip_of(raw: RawMotion, file: File, texts: Described, family: str = "") -> Clip:
    """The clip of a usable motion.

    Args:
        raw: the motion, with unit quaternions.
        file: the file that it comes from.
        texts: its captions.
        family: kind of motion by which motions are held out.

    Raises:
        BadInput: a check that it fails.
    """
    clip = make_clip(
        safe_stem(raw.name, "motion"),
        raw.fps,
        raw.root_pos,
        raw.root_quat,
        raw.joint_pos,
        captions=texts.captions,
        caption_source=texts.source,
        source=file.source,
        licence=file.licence,
        sha256=file.sha256,
        family=family,
    )
    check_clip(raw.where, clip)
    return clip
