"""Settings of a plan."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from bumblebee.diagnosis.thresholds import Thresholds


class Gain(NamedTuple):
    """Factors on the servos' gains."""

    kp: float = 1.0
    kd: float = 1.0

    def __str__(self) -> str:
        """In words."""
        parts = [f"{name} x {value:g}" for name, value in self._asdict().items() if value != 1.0]
        return ", ".join(parts) or "declared gains"


@dataclass(frozen=True)
class PlanConfig:
    """How many runs, how long, within which limits."""

    runs: int = 4
    """Runs of the plan."""
    seconds: float = 8.0
    """Length of a run with its rests [s]."""
    rate: float | None = None
    """Rate of the targets [Hz]; None: the dataset's, or 50."""
    gains: tuple[float, ...] = (1.0,)
    """Factors on kp at which runs may be made; 1 is the declared gain."""
    damping: tuple[float, ...] = ()
    """Factors on kd, at the declared kp, at which runs may be made besides."""
    pool: int = 48
    """Candidate motions that the runs are chosen from."""
    seed: int = 0
    """Seed of the candidate motions."""
    start: str | None = None
    """Name of the keyframe that runs start and end in."""
    speed: Mapping[str, float] = field(default_factory=dict)
    """Speed limits [rad/s, m/s] by joint; "" for all others."""
    torque: Mapping[str, float] = field(default_factory=dict)
    """Torque limits [N m, N] by joint; "" for all others; the model's, where both are, if lower."""
    travel: Mapping[str, float] = field(default_factory=dict)
    """How far a joint may go to either side of the start [rad, m], by joint; "" for all others."""
    kp: float | None = None
    """Gain of the servo that tracks the targets on drives that take torques [N m/rad, N/m]."""
    kd: float | None = None
    """Gain on the velocity [N m s/rad, N s/m]."""
    thresholds: Thresholds = field(default_factory=Thresholds)
    """Every number that single decisions go by."""

    @property
    def all_gains(self) -> tuple[Gain, ...]:
        """Gains at which runs may be made, each once."""
        every = [*(Gain(kp=g) for g in self.gains), *(Gain(kd=d) for d in self.damping)]
        return tuple(dict.fromkeys(every))
