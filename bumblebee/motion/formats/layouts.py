"""Which joints the columns of a motion of the G1 are: all 29, or one of the two layouts of 23 that the field uses.

ASAP, PHC, H2O, TWIST and this project leave out the wrists. The G1 that Unitree sells with 23 joints has one waist
joint and rolls its wrists. The legs and the waist's yaw stand in the same columns of both, the arms do not, and no
number tells them apart: names do, rotations about the joints' axes do, bodies do; else the layout is asked for.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.reading.remedy import say
from bumblebee.robot.facts import joint_names

ASAP, UNITREE = "asap", "unitree"
_LOCKED = ("waist_roll_joint", "waist_pitch_joint")
NOTE = "23 joints as in Unitree's own G1 of 23: waist roll and pitch are 0, wrist rolls are not read"


@cache
def layouts(dof: int) -> dict[str, tuple[str, ...]]:
    """The layouts of so many joints, 29 or 23: the joints' names in Unitree's order by the layout's name."""
    if dof == len(joint_names(29)):
        return {"": joint_names(29)}
    left_out = {
        *_LOCKED,
        *(name for name in joint_names(29) if name.endswith(("wrist_pitch_joint", "wrist_yaw_joint"))),
    }
    return {ASAP: joint_names(), UNITREE: tuple(name for name in joint_names(29) if name not in left_out)}


def layout_of(where: object, dof: int, stated: str) -> tuple[str, ...]:
    """Names of the 29 or 23 joints of a file that names none.

    Args:
        where: the file, and the place in it.
        dof: number of joints.
        stated: the layout of 23 joints as the user says it; "" if they do not.

    Raises:
        BadInput: 23 joints, and nobody says which.
    """
    known = layouts(dof)
    if len(known) > 1 and not stated:
        raise BadInput(where, "names of the joints", "23 joints without names", QUESTION)
    return known[stated] if len(known) > 1 else next(iter(known.values()))


QUESTION = "ASAP's 23 have three waist joints and no wrists, those of Unitree's G1 of 23 one and wrist rolls. " + say(
    {"joints_23": ASAP}, {"joints_23": UNITREE}
)


def require_joints(where: object, names: Sequence[str], kind: str = "name", first: int = 1) -> None:
    """See that joints by name are those of a G1.

    Args:
        where: the names' place.
        names: in the file's order.
        kind: what a message counts: names of a list, columns of a table.
        first: number of the first name.

    Raises:
        BadInput: a joint twice, one that no G1 has, or one missing that every G1 has.
    """
    for number, name in enumerate(names):
        if name not in joint_names(29):
            came = f"unknown joint {name.removesuffix('_joint')[:60]!r}"
            raise BadInput(f"{where}, {kind} {first + number}", "the name of a G1 joint", came)
        if name in names[:number]:
            came = f"{name} in {kind}s {first + names.index(name)} and {first + number}"
            raise BadInput(where, "each joint once", came)
    missing = [name for name in joint_names() if name not in names]
    if missing and set(missing) != set(_LOCKED):
        wanted = "each of the 23 joints (the 6 wrist joints may follow; waist roll and pitch may be missing together)"
        raise BadInput(where, wanted, f"none for {missing[0]}")


def arranged(values: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Joint angles (T, 23) [rad] in the order of `joint_names()`, from columns (T, n) of the named joints.

    A waist joint that the robot does not have is 0; wrists are dropped.
    """
    found = [values[:, names.index(name)] if name in names else np.zeros(len(values)) for name in joint_names()]
    return np.stack(found, axis=1)


def notes_of(names: tuple[str, ...]) -> tuple[str, ...]:
    """A note where joints of the robot here are not those of the file's."""
    return (NOTE,) if _LOCKED[0] not in names else ()
