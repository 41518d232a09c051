"""Which joints the columns of a motion of the robot are: all of them, or one of the layouts that its file names.

Of the G1 these are all 29, and the two of 23 that the field uses.

ASAP, PHC, H2O, TWIST and this project leave out the wrists. The G1 that Unitree sells with 23 joints has one waist
joint and rolls its wrists. The legs and the waist's yaw stand in the same columns of both, the arms do not, and no
number tells them apart: names do, rotations about the joints' axes do, bodies do; else the layout is asked for.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.reading.remedy import say
from bumblebee.robot.facts import LAYOUTS, ROBOT, joint_names

ASAP, UNITREE = "asap", "unitree"
NOTE = "23 joints as in Unitree's own G1 of 23: waist roll and pitch are 0, wrist rolls are not read"


@cache
def layouts(count: int) -> dict[str, tuple[str, ...]]:
    """The layouts of so many joints: names in the robot's order by the layout's name, which is "" for every joint."""
    every = joint_names(every=True)
    known = {"": every, **{name: tuple(n for n in every if n not in left) for name, left in LAYOUTS.items()}}
    if joint_names() not in known.values():
        known["own"] = joint_names()
    return {name: names for name, names in known.items() if len(names) == count}


@cache
def sizes() -> tuple[int, ...]:
    """Numbers of joints that a file may have, the largest first."""
    every = joint_names(every=True)
    return tuple(sorted({len(every), len(joint_names()), *(len(every) - len(left) for left in LAYOUTS.values())})[::-1])


def layout_of(where: object, count: int, stated: str) -> tuple[str, ...]:
    """Names of the joints of a file that names none.

    Args:
        where: the file, and the place in it.
        count: number of joints, one of `sizes()`.
        stated: the layout of 23 joints as the user says it; "" if they do not.

    Raises:
        BadInput: 23 joints, and nobody says which.
    """
    known = layouts(count)
    if len(known) > 1 and not stated:
        raise BadInput(where, "names of the joints", "23 joints without names", QUESTION)
    return known[stated] if len(known) > 1 else next(iter(known.values()))


QUESTION = "ASAP's 23 have three waist joints and no wrists, those of Unitree's G1 of 23 one and wrist rolls. " + say(
    {"joints_23": ASAP}, {"joints_23": UNITREE}
)


def require_joints(where: object, names: Sequence[str], kind: str = "name", first: int = 1) -> None:
    """See that joints by name are those of the robot.

    Args:
        where: the names' place.
        names: in the file's order.
        kind: what a message counts: names of a list, columns of a table.
        first: number of the first name.

    Raises:
        BadInput: a joint twice, one that the robot does not have, or one missing that no known layout leaves out.
    """
    for number, name in enumerate(names):
        if name not in joint_names(every=True):
            came = f"unknown joint {name.removesuffix('_joint')[:60]!r}"
            raise BadInput(f"{where}, {kind} {first + number}", f"the name of a joint of {ROBOT}", came)
        if name in names[:number]:
            came = f"{name} in {kind}s {first + names.index(name)} and {first + number}"
            raise BadInput(where, "each joint once", came)
    missing = [name for name in joint_names() if name not in names]
    every = joint_names(every=True)
    if missing and not any(set(missing) == set(joint_names()) & set(left) for left in LAYOUTS.values()):
        wanted = f"each of the {len(joint_names())} joints"
        if len(every) > len(joint_names()):
            wanted += f" (the other {len(every) - len(joint_names())} may follow)"
        raise BadInput(where, wanted, f"none for {missing[0]}")


def arranged(values: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Joint angles (T, 23) [rad] in the order of `joint_names()`, from columns (T, n) of the named joints.

    A joint that the file lacks is 0; those that are held still here, such as wrists, are dropped.
    """
    found = [values[:, names.index(name)] if name in names else np.zeros(len(values)) for name in joint_names()]
    return np.stack(found, axis=1)


def notes_of(names: tuple[str, ...]) -> tuple[str, ...]:
    """A note where joints of the robot here are not those of the file's."""
    missing = [name for name in joint_names() if name not in names]
    if missing and set(missing) == set(joint_names()) & set(LAYOUTS.get(UNITREE, ())):
        return (NOTE,)
    return (f"joints that the file lacks are 0: {', '.join(missing)}",) if missing else ()
