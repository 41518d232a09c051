"""The motions of one file, whatever its format: told by its suffix, and for `.npz` by the arrays in it."""

from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.read import SUFFIXES as ROBOT
from bumblebee.motion.formats.read import is_robot_npz, read_robot
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.human.read import SUFFIXES as HUMAN
from bumblebee.motion.human.read import HumanConfig, read_human
from bumblebee.motion.raw import RawMotion

READ = tuple(dict.fromkeys((*ROBOT, *HUMAN)))
_NOT_READ = {
    ".npy": "a single NumPy array, which does not say what it holds",
    ".fbx": "an FBX file: export it as BVH",
    ".c3d": "markers without a skeleton (C3D): fit one first, as SMPL or BVH",
    ".7z": "a 7z archive: unpack it, or pack it as zip or tar",
    ".rar": "a RAR archive: unpack it, or pack it as zip or tar",
}


def read_one(path: Path, data: bytes, robot: RobotConfig, human: HumanConfig) -> list[RawMotion | HumanMotion]:
    """The motions of a file, of the robot or of people, at the file's own rate and unchecked.

    Args:
        path: as it is shown; its suffix says how it is read.
        data: its bytes.
        robot: what files of robot motion may leave unsaid.
        human: what files of human motion may leave unsaid.

    Raises:
        BadInput: a format that is not read, or what is wrong in the file.
    """
    suffix = path.suffix.lower()
    if suffix not in READ:
        wanted = f"motions ({', '.join(READ)}), an archive of such, or a motion library"
        raise BadInput(path, wanted, _NOT_READ.get(suffix, "a format that is not known"))
    if suffix in ROBOT and (suffix != ".npz" or is_robot_npz(data)):
        return [*read_robot(path, data, robot)]
    return [*read_human(path, data, human)]
