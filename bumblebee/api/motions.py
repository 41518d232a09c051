"""Read motions, make one from arrays, put a person's motion on the G1, draw a motion."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.api import checks
from bumblebee.errors import BadInput
from bumblebee.learning.pretrained import THEIRS
from bumblebee.motion.clip import Clip
from bumblebee.robot.facts import ROBOT, joint_names

EMBEDDED = "embedded"


def _warn(line: str) -> None:
    warnings.warn(line, stacklevel=3)


def read_motions(
    path: str | Path = EMBEDDED, *, max_seconds: float = 0.0, say: Callable[[str], None] = _warn, **settings: Any
) -> list[Clip]:
    """Read all motions at a path as motions of the G1 at 50 Hz; people's are retargeted, once for each file.

    Args:
        path: a file, a folder or an archive in any format that docs/data.md lists, a motion library, or
            `"embedded"` for the 59 motions that come along.
        max_seconds: cut longer motions into equal pieces of at most this length [s]; 0 cuts none.
        say: called with a line for files that are skipped; by default the line becomes a Python warning.
        **settings: what files leave unsaid, by the fields of `bumblebee.motion.reading.settings.ReadConfig`, such as
            `csv_fps=60`; for the embedded motions the fields of `bumblebee.motion.embedded.EmbeddedConfig`.

    Returns:
        Motions in the order of their files: `root_pos` (T, 3) [m, world], `root_quat` (T, 4) [wxyz, body to world],
            `joint_pos` (T, 23) [rad] in the order of `bumblebee.joint_names()`.

    Raises:
        BadInput: nothing at the path, no motion in it, or a setting out of its range.

    Examples:
        >>> import bumblebee as bb
        >>> motions = bb.read_motions("embedded", families=("stand",), limit=2)
        >>> len(motions), motions[0].joint_pos.shape[1]
        (2, 23)
    """
    from bumblebee.motion.cache import user_cache
    from bumblebee.motion.embedded import EmbeddedConfig, make_library
    from bumblebee.motion.reading.folder import read_folder
    from bumblebee.motion.reading.settings import ReadConfig

    if str(path) == EMBEDDED:
        if ROBOT != THEIRS:
            came = f"those that come along for {THEIRS}, and this is {ROBOT}"
            raise BadInput("motions", "a folder of motion files", came, "Name one of BVH or SMPL files.")
        return make_library(_settings(EmbeddedConfig, settings))
    config = _settings(ReadConfig, {"max_seconds": max_seconds, **settings})
    reading = read_folder(Path(path).expanduser(), config, cache=user_cache())
    for line in reading.skipped_lines:
        say(line)
    return reading.clips


def _settings(kind: Callable[..., Any], given: Mapping[str, Any]) -> Any:
    """Settings from keyword arguments.

    Raises:
        BadInput: a keyword that the settings do not know, or a value out of its range.
    """
    known = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    for name in given:
        if name not in known:
            raise BadInput("read_motions", f"a setting among {', '.join(known)}", repr(name))
    return kind(**given)


def make_motion(name: str, fps: float, root_pos: Any, root_quat: Any, joint_pos: Any, family: str = "") -> Clip:
    """Make a motion of the G1 from arrays.

    Args:
        name: its name.
        fps: samples a second [Hz].
        root_pos: position of the pelvis, (T, 3) [m, world, z up].
        root_quat: orientation of the pelvis, (T, 4) [wxyz, body to world]; normalised here.
        joint_pos: joint angles, (T, 23) [rad] in the order of `bumblebee.joint_names()`.
        family: kind of motion (walk, jump ...), or nothing.

    Returns:
        The motion, with the positions of its 14 key bodies by forward kinematics.

    Raises:
        BadInput: an array of another shape, arrays of different lengths, NaN, or a rate that is not positive.

    Examples:
        >>> import bumblebee as bb, numpy as np
        >>> still = bb.make_motion("still", 50, np.tile([0, 0, 0.76], (100, 1)), np.tile([1, 0, 0, 0], (100, 1)),
        ...                        np.zeros((100, 23)))
        >>> still.duration
        1.98
    """
    from bumblebee.motion.kinematics import make_clip

    arrays = [
        checks.array("root_pos", root_pos, "T", 3),
        checks.array("root_quat", root_quat, "T", 4),
        checks.array("joint_pos", joint_pos, "T", len(joint_names())),
    ]
    lengths = [len(one) for one in arrays]
    if len(set(lengths)) > 1 or not lengths[0]:
        raise BadInput("root_pos, root_quat, joint_pos", "one length T of at least 1", f"lengths {lengths}")
    if not fps > 0:
        raise BadInput("fps", "a number above 0", repr(fps))
    if not np.linalg.norm(arrays[1], axis=1).all():
        raise BadInput("root_quat", "quaternions that are not zero", "a row of zeros")
    return make_clip(name, fps, *arrays, family=family)


def retarget(positions: Any, fps: float, name: str = "motion", *, out_fps: float = 50.0) -> Clip:
    """Put a person's motion on the G1 by inverse kinematics over the whole trajectory.

    `read_motions` does this for files of people; this function takes positions from any other source.

    Args:
        positions: positions of the 18 landmarks `bumblebee.motion.human.motion.LANDMARKS`, (T, 18, 3)
            [m, world, z up, floor near 0]; `left` is the person's left.
        fps: samples a second [Hz].
        name: name of the motion.
        out_fps: rate of the result [Hz].

    Returns:
        The motion of the G1.

    Raises:
        BadInput: another shape, NaN, too few frames, or a body that no robot can follow.
    """
    from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
    from bumblebee.motion.kinematics import make_clip
    from bumblebee.motion.retarget.retarget import retarget as put

    person = checks.array("positions", positions, "T", len(LANDMARKS), 3)
    raw = put(HumanMotion(name, float(fps), person, Path(name)), out_fps)
    return make_clip(name, out_fps, raw.root_pos, raw.root_quat, raw.joint_pos)


def film(motion: Clip, out: str | Path, *, start: float = 0.0, end: float = 10.0) -> Path:
    """Draw a motion as a film or a filmstrip.

    Args:
        motion: the motion.
        out: a film (`.gif`, `.webp`, or `.mp4` where ffmpeg is installed) or a filmstrip (`.png`); one that is there
            is replaced.
        start: where it begins [s].
        end: where it ends at the latest [s].

    Returns:
        The file.

    Raises:
        BadInput: another suffix, or a start after the motion's end.

    Examples:
        >>> import bumblebee as bb
        >>> bb.film(bb.read_motions("embedded", limit=1)[0], "stand.png", end=1.0).name
        'stand.png'
    """
    from bumblebee.report.films.playback import PlayConfig, write_pictures

    write_pictures(Path(out), checks.motions(motion, "motion")[0], PlayConfig(start=start, end=end))
    return Path(out)
