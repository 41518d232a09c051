"""Units of what sits on a joint: a hinge turns, a slide moves, and all that is N m on the one is N on the other."""

_ON_SLIDE = {"kg m^2": "kg", "1/turn": "rad/m", "mrad": "mm"}  # 1/turn of a phase: sin(value * position)


def joint_unit(hinge: str, slide: bool) -> str:
    """The unit that a quantity has on a joint, from the one that it has on a hinge."""
    return _ON_SLIDE.get(hinge, hinge.replace("N m", "N").replace("rad", "m")) if slide else hinge


def both_units(hinge: str) -> str:
    """The unit on a hinge and, where it is another, on a slide: for a message that knows no joint."""
    other = joint_unit(hinge, True)
    return hinge if other == hinge else f"{hinge} ({other} on a slide)"
