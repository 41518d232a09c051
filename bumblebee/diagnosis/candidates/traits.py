"""Effects of the catalogue by what the diagnosis must know of them beside their equations."""

from collections.abc import Iterable

from bumblebee.sim.effects import CATALOGUE


def _which(trait: str, *values: object) -> tuple[str, ...]:
    return tuple(name for name, kind in CATALOGUE.items() if getattr(kind, trait) in values)


INVERSE, ABRUPT, JUDGED_ALONE, SATURATIONS, SHAPED = (
    _which(trait, True) for trait in ("inverse", "abrupt", "judged_alone", "saturation", "on_dry_friction")
)
USUAL_OF_ROBOT, USUAL_OF_BODIES = (_which("usual", of) for of in ("robot", "body"))
(IMU_TILT,) = _which("base", True)


def exclude(one: str, other: str) -> bool:
    """Whether a joint cannot have both."""
    return other in CATALOGUE[one].beside or one in CATALOGUE[other].beside


def experiment(kind: str, floating: bool) -> str:
    """Experiment that tells a kind from what looks the same, on a robot whose base is free or not."""
    return (not floating and CATALOGUE[kind].on_fixed_base) or CATALOGUE[kind].experiment


def naming_order(kind: str) -> int:
    """The place of a kind among effects that fit the same; the usual ones first."""
    return CATALOGUE[kind].named_first or max(other.named_first for other in CATALOGUE.values()) + 1


def rough(kinds: Iterable[str]) -> bool:
    """Whether coarse steps do for differences between models with these effects."""
    return not any(CATALOGUE[kind].fine_steps for kind in kinds)
