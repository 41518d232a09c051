"""A kind of effect in the lottery, and the place where one sits.

A size is a number >= 0 that grows with the effect; 0 is the declared robot. A draw fixes what a size leaves open
(signs, axes, harmonics).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.law import Law


@dataclass(frozen=True, eq=False)
class Place:
    """Where one effect sits, and what its law needs to know of the declared robot there."""

    robot: Declared
    name: str
    """Joint or body; "" for the whole robot."""
    draw: dict[str, Any]
    """sign (1 or -1), axis (0 to 2), number (harmonic), other (another joint)."""
    peak_torque: float = 0.0
    """Largest torque of this joint's drive in the declared robot's motion [N m]."""
    peak_speed: float = 0.0
    """Largest speed there [rad/s]."""
    peak_rate: float = 0.0
    """Largest change of its command, per second [rad/s]."""

    @property
    def j(self) -> int:
        """Column of the joint."""
        return self.robot.joints.index(self.name)

    def of(self, table: np.ndarray) -> float:
        """This joint's entry in (J,)."""
        return float(table[self.j])


Made = tuple[Law, dict[str, float]]
"""A law, and its parameters by the contract's names (absolute values)."""


@dataclass(frozen=True)
class Kind:
    """One kind of effect."""

    name: str
    on: str
    """joint, pair (a joint with another before it), crossed (these not about parallel axes), body, base, whole."""
    make: Callable[[Place, float], Made]
    first: Callable[[Place], float]
    """A small size to begin the search for the detectable one with."""
    most: Callable[[Place], float]
    """The largest size that is still this robot."""
    least: Callable[[Place], float] = lambda p: 0.0
    """The smallest size that the true robots' simulation can hold."""
    events: float = 0.0
    """How often it must strike, on average, to strike at all four times in five; then its size is a share of ticks."""
    robots: str = "both"
    """both, arm or g1."""
    group: str = "joint"
    """joint, mass, contact, sensor: for the table."""
    parts: tuple[str, ...] = field(default=())
    """Other names of the catalogue under which a part of it is rightly found at the same place."""
    depends: tuple[str, ...] = field(default=())
    """Outside the catalogue: what it depends on, in the diagnosis's words; any of them is right."""
    unit: str = ""
    """Units of its parameters; "" for a share or a factor."""
    fault: Callable[[Place], float] | None = None
    """The largest size that is still a robot with a fault, not another robot; None: `most`."""

    @property
    def outside(self) -> bool:
        """Whether the contract's catalogue has no name for it."""
        return bool(self.depends)


def fits(kind: Kind, robot: str) -> bool:
    """Whether a kind can sit on a robot (`arm`, or a G1)."""
    return kind.robots == "both" or (kind.robots == "arm") == (robot == "arm")


def places(kind: Kind, robot: Declared) -> tuple[str, ...]:
    """Names where a kind can sit; ("",) where it has the whole robot or its base."""
    if kind.on == "joint":
        return robot.joints
    if kind.on in ("pair", "crossed"):
        return tuple(robot.chained) if kind.on == "pair" else robot.crossed
    if kind.on == "body":
        return tuple(b for b in robot.bodies if robot.mass[b] >= 0.25)
    return robot.bodies[:1] if kind.on == "base" and robot.floating else ("",)
