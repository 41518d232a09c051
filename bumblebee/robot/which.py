"""Which robot this process is for: a folder, or one of those that come along, by the environment's BUMBLEBEE_ROBOT."""

import os
from pathlib import Path

from bumblebee.errors import BadInput

VARIABLE = "BUMBLEBEE_ROBOT"
DEFAULT = "g1_23"
FILE = "robot.yaml"
SHIPPED = Path(__file__).with_name("robots")


def chosen_name() -> str:
    """The name or folder that the environment says; without, our G1."""
    return os.environ.get(VARIABLE) or DEFAULT


def shipped() -> list[str]:
    """Names of the robots that come along."""
    return sorted(path.stem for path in SHIPPED.glob("*.yaml") if not path.stem.endswith("_bodies"))


def path_of(name: str) -> Path:
    """The file of a robot by its name, or of a folder with one.

    Raises:
        BadInput: neither is there.
    """
    own = Path(name).expanduser()
    for path in (SHIPPED / f"{name}.yaml", own / FILE):
        if path.is_file():
            return path
    expected = f"a folder with a {FILE}, or one of {', '.join(shipped())}"
    do = "`bumblebee robot inspect MODEL.xml --out FOLDER` writes a first one."
    raise BadInput(f"robot {name}", expected, "neither", do)
