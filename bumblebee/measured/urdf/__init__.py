"""A URDF as an MJCF that loads: what is not logged is held still, what MuJoCo refuses is mended and told."""

from bumblebee.measured.urdf.convert import DRIVES, Drives, Made, from_urdf

__all__ = ["DRIVES", "Drives", "Made", "from_urdf"]
