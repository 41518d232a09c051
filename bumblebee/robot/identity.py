"""Whether something was made for the robot of this process: policies say in their files whose they are."""

from collections.abc import Mapping
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.robot.facts import IDENTITY, ROBOT, joint_names
from bumblebee.robot.which import VARIABLE


def require_robot(where: object, stated: Mapping[str, Any], actions: int) -> None:
    """Refuse what another robot's training wrote.

    Args:
        where: the file.
        stated: its `robot` and `robot_sha256`; what was written before there was a choice says neither.
        actions: number of joints that it commands.

    Raises:
        BadInput: another robot's name, another hash, or another number of joints.
    """
    if stated.get("robot", ROBOT) != ROBOT:
        do = f"Name the robot that it was made for: `bumblebee --robot FOLDER ...`, or {VARIABLE}=FOLDER."
        raise BadInput(f"{where}: robot", repr(ROBOT), repr(stated["robot"])[:60], do)
    if stated.get("robot_sha256", IDENTITY) != IDENTITY:
        came = f"{str(stated['robot_sha256'])[:12]}, a {ROBOT} of other bodies, motors or stand"
        raise BadInput(f"{where}: robot_sha256", IDENTITY[:12], came, "Train for the robot as it is now.")
    if "robot" not in stated and actions != len(joint_names()):
        raise BadInput(f"{where}: actions", f"{len(joint_names())}, the joints of {ROBOT}", str(actions))
