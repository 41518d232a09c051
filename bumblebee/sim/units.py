"""Units of what sits on a joint: a hinge turns, a slide moves, and all that is N m on the one is N on the other."""

_ON_SLIDE = {
    "rad": "m",
    "mrad": "mm",
    "rad/s": "m/s",
    "rad/s^2": "m/s^2",
    "N m s^2/rad^2": "N s^2/m^2",
    "N m": "N",
    "N m/rad": "N/m",
    "N m s/rad": "N s/m",
    "kg m^2": "kg",
    "1/turn": "rad/m",  # of a phase: sin(value * position)
}
_ON_BOTH = ("", "s", "1/s")


def is_known(unit: str) -> bool:
    """Whether it is told what a quantity of this unit on a hinge has on a slide."""
    return unit in _ON_SLIDE or unit in _ON_BOTH


def joint_unit(hinge: str, slide: bool) -> str:
    """The unit that a quantity has on a joint, from the one that it has on a hinge."""
    return _ON_SLIDE.get(hinge, hinge) if slide else hinge


def both_units(hinge: str) -> str:
    """The unit on a hinge and, where it is another, on a slide: for a message that knows no joint."""
    other = joint_unit(hinge, True)
    return hinge if other == hinge else f"{hinge} ({other} on a slide)"
