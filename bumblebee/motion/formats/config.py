"""Settings that a file of robot motion may leave unsaid, and who reads it must say."""

from dataclasses import dataclass
from typing import Annotated, Literal

from bumblebee.ranges import Range, Ranged

Euler = Literal["", "xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]


@dataclass(frozen=True)
class RobotConfig(Ranged):
    """Settings of the readers of robot motion; "" and None: the file must say it, or is refused with a line."""

    csv_fps: Annotated[float, Range(least=1, most=1000)] | None = None
    """Frame rate of CSV files, which do not hold one [Hz]."""
    csv_length: Literal["", "m", "cm", "mm"] = ""
    """Unit of the root's position in a CSV file with Euler angles."""
    csv_angle: Literal["", "rad", "deg"] = ""
    """Unit of Euler and joint angles in such a file."""
    csv_euler: Euler = ""
    """Order of its Euler angles as SciPy writes it: small letters about the world's axes, capitals about the body's."""
    npz_joints: Literal["", "depth_first", "breadth_first"] = ""
    """Order of the joints in an `.npz` file whose bodies do not tell: depth-first (MuJoCo), breadth-first (Isaac)."""
    joints_23: Literal["", "asap", "unitree"] = ""
    """Which 23 joints a file has that names none; see `bumblebee/motion/formats/layouts.py`."""
    quaternion: Literal["", "xyzw", "wxyz"] = ""
    """Order of the root's quaternion; empty: the file's, held against the motion."""
