"""Thresholds of proposals on the laws of friction."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Stribeck:
    """Thresholds for friction that grows at rest and the dry friction that it sits on."""

    dry_z: float = 3.0
    """Standard errors of the dry friction: as a parameter of the same friction, not one of all candidates."""
    rest: float = 0.6
    """Share of other friction that is left when its level is taken from it."""
    creep: tuple[float, ...] = (0.06, 0.2)
    """Velocities at which friction is tried to grow, as shares of the joint's usual speed."""
    shape_scale: float = 0.3
    """Share of such a velocity that matters."""
    iterations: int = 5
    """Iterations of the joint fit of the two."""


@dataclass(frozen=True)
class HysteresisLaw:
    """Thresholds for the two laws of hysteresis, each tried in the place of the other."""

    widths: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
    """Widths of the other law, in those of the one: a spring that yields at a third of Dahl's width is most like it."""
    shape: float = 0.3
    """Share of a width that matters."""
    iterations: int = 4
    """Iterations of the joint refit."""


@dataclass(frozen=True)
class FrictionFamily:
    """Thresholds for the sums of a joint's friction."""

    sure: float = 4.0
    """Standard errors that a further member must reach: as a number of the same friction, not one of all candidates."""
    clearly: float = 1.0
    """Log-likelihood by which a sum must be better beyond the price of its numbers."""
    promising: float = 8.0
    """Fall of the cost, in the residual's power, that the screening windows must promise."""
    tried: int = 3
    """Members tried at their size for each that is taken."""
    few_joints: int = 8
    """Joints with friction up to which all are asked; of more, those of the shortlist that lack most torque."""
    iterations: int = 3
    """Iterations of the joint refit."""
