"""The motions of one file, whatever its format: told by its suffix, and for `.npz` by the arrays in it."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from bumblebee.errors import BadInput
from bumblebee.motion.formats.config import Euler, RobotConfig
from bumblebee.motion.formats.others import refuse_known, what_it_is
from bumblebee.motion.formats.read import SUFFIXES as ROBOT
from bumblebee.motion.formats.read import is_robot_npz, read_robot
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.human.npz import npz_keys
from bumblebee.motion.human.read import SUFFIXES as HUMAN
from bumblebee.motion.human.read import HumanConfig, read_human
from bumblebee.motion.human.skeleton_file import read_stated
from bumblebee.motion.raw import RawMotion
from bumblebee.ranges import Line, Range, Ranged, Unfit

READ = tuple(dict.fromkeys((*ROBOT, *HUMAN)))


@dataclass(frozen=True)
class FileConfig(Ranged):
    """Settings that files may leave unsaid; "", None and 0: the file or its motion tells it, or it is refused."""

    csv_fps: Annotated[float, Range(least=1, most=1000)] | None = None
    """Frame rate of CSV files, which do not hold one: g1_moves 60, LAFAN1's retargets 30 [Hz]. Without it, that which
    LICENCES.csv beside the file or a row of SOURCES.md states."""
    csv_length: Literal["", "m", "cm", "mm"] = ""
    """Unit of the root's position in a CSV file with Euler angles."""
    csv_angle: Literal["", "rad", "deg"] = ""
    """Unit of Euler and joint angles in such a file."""
    csv_euler: Euler = ""
    """Order of its Euler angles as SciPy writes it: small letters about the world's axes, capitals about the body's."""
    npz_joints: Literal["", "depth_first", "breadth_first"] = ""
    """Order of the joints in an `.npz` file whose bodies do not tell: depth-first (MuJoCo), breadth-first (Isaac)."""
    joints_23: Literal["", "asap", "unitree"] = ""
    """Which 23 joints a file has that names none: ASAP's (three waist joints, no wrists), or those of the G1 that
    Unitree sells with 23 (one waist joint, a wrist roll on each side)."""
    quaternion: Literal["", "xyzw", "wxyz"] = ""
    """Order of the root's quaternion in files of the robot; empty: the file's, held against the motion."""
    unit: Literal["", "m", "dm", "cm", "mm", "inch", "cmu"] = ""
    """Unit of BVH files; empty: by the length of the legs. `cmu` is 1 / 0.45 inch."""
    up: Literal["", "x", "y", "z", "-x", "-y", "-z"] = ""
    """The up axis of human motion; empty: BVH's by the body, that of SMPL files z, where the body stands so."""
    smpl_fps: Annotated[float, Range(least=0, most=1000)] = 0.0
    """Frame rate of SMPL files that state none [Hz]."""
    skeleton: Line = ""
    """A YAML file that says which joint of BVH files is which landmark; empty: recognised, or asked for."""

    def require_skeleton(self) -> None:
        """Refuse a mapping of joints that is none once, before any file is read.

        Raises:
            BadInput: what is wrong in the file.
        """
        if self.skeleton:
            read_stated(self.skeleton)

    def rate_below(self, place: Path) -> float | None:
        """Rate of the CSV files in a folder by its name, where the settings say one [Hz]."""
        return None

    @property
    def robot(self) -> RobotConfig:
        """Settings of motions of the robot."""
        return RobotConfig(**{field.name: getattr(self, field.name) for field in fields(RobotConfig)})

    @property
    def human(self) -> HumanConfig:
        """Settings of motions of people."""
        return HumanConfig(self.unit, self.up, self.smpl_fps, read_stated(self.skeleton) if self.skeleton else None)


def stated(settings: Iterable[str], **options: Any) -> FileConfig:
    """The settings as a command line states them.

    Args:
        settings: texts KEY=VALUE with the fields of `FileConfig`.
        options: fields that have an option of their own; None and "" are not said.

    Raises:
        BadInput: no such key, or a value that it does not take.
    """
    known = [field.name for field in fields(FileConfig)]
    given = {key: value for key, value in options.items() if value not in (None, "")}
    for text in settings:
        key, _, value = text.partition("=")
        if key not in known:
            raise BadInput("--set", f"KEY=VALUE with a key among {', '.join(known)}", repr(text)[:80])
        given[key] = value
        if key.endswith("_fps"):
            try:
                given[key] = float(value)
            except ValueError:
                raise BadInput(f"--set {key}", "a number of frames a second", repr(value)[:60]) from None
    try:
        return FileConfig(**given)
    except Unfit as error:
        expected = error.expected.replace("one of , ", "one of ")  # "" stands for: not said
        raise BadInput(f"--set {error.field}", expected, error.came) from None


def read_one(path: Path, data: bytes, config: FileConfig) -> list[RawMotion | HumanMotion]:
    """The motions of a file, of the robot or of people, at the file's own rate and unchecked.

    Args:
        path: as it is shown; its suffix says how it is read.
        data: its bytes.
        config: what the file may leave unsaid.

    Raises:
        BadInput: a format that is not read, or what is wrong in the file.
    """
    suffix = path.suffix.lower()
    if suffix not in READ:
        wanted = f"motions ({', '.join(READ)}), an archive of such, or a motion library"
        raise BadInput(path, wanted, *what_it_is(path, data))
    if suffix in ROBOT and (suffix != ".npz" or is_robot_npz(data)):
        return [*read_robot(path, data, config.robot)]
    if suffix == ".npz":
        refuse_known(path, dict.fromkeys(npz_keys(path, data)))
    return [*read_human(path, data, config.human)]
