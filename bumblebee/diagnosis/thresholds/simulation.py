"""Numbers that the simulation of windows goes by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Windowing:
    """Settings of the stretches of the logs that are restarted and compared."""

    lead: float = 0.1
    """A window starts this long after its rollout [s], so that a delayed command is known from the start."""
    first_output: float = 0.02
    """Nothing is compared sooner after a start [s]: at 500 Hz the next reading says only that the start was read."""
    gap: float = 1.8
    """Periods between two rows from which on a tick is missing between them."""
    outputs: int = 6
    """Compared ticks of a window, the last among them."""


@dataclass(frozen=True)
class ActuatorHistory:
    """Settings of the drives' memory from before a window's start."""

    smooth: int = 3
    """Ticks to either side that a velocity is a mean over: what a sensor's noise would wear off is no motion."""
    passes: int = 60
    """Passes at most, until a drive's heat and the strength that it leaves agree."""
    settled: float = 1e-9
    """Heat [s] by which two passes differ at most in the end."""
    set_point: float = 10.0
    """Time [s] after which a filtered, limited or profiled target knows nothing of where it was."""


@dataclass(frozen=True)
class JointPath:
    """Settings of a joint's path without its sensor's noise."""

    least_rows: int = 8
    """Rows of a log below which it is left as it is."""
    least_place: float = 1e-6
    """Noise of a position at least [rad, m]."""
    least_speed: float = 1e-5
    """Noise of a velocity at least [rad/s, m/s]."""
    decades: int = 8
    """Intensities of the acceleration that are tried, each a tenth of the one before; the first explains all."""
    freedom: float = 4.0
    """Degrees of freedom of Student's t that accelerations follow; 1 to 4 gave the same paths."""
    rest: float = 0.1
    """Scale of that, as a share of the most likely intensity of even noise; 0.03 to 0.3 gave the same paths."""
    rounds: int = 6
    """Rounds of weighing the steps anew; 3 to 15 gave the same paths."""


@dataclass(frozen=True)
class BaseHeight:
    """Settings of the height of a base that no sensor reads."""

    rest_depth: float = 0.001
    """Depth at which a standing robot rests in MuJoCo's soft floor with default contact parameters [m]."""


@dataclass(frozen=True)
class CollisionCulling:
    """Settings of geometries that can touch nothing within a window."""

    fastest: float = 2.5
    """Speed at which a geometry may come down on the mean over a window [m/s]."""


@dataclass(frozen=True)
class HiddenStates:
    """Settings of backlash, flexible shafts and yielding springs, whose states no sensor reads."""

    step_share: float = 0.5
    """Share of the usual step that backlash and shafts read on the joint need.

    Behind a shaft the servo's own delay of half a step acts as stiffness, and the ends of a gap are met one and a half
    steps late, which is as if it were wider.
    """


@dataclass(frozen=True)
class Solver:
    """Settings of MuJoCo's solver: what is compared is physics, not a solver's haste."""

    iterations: int = 30
    """Iterations at least, whatever a training model allows itself."""
    line_search: int = 20
    """Iterations of its line search at least."""


@dataclass(frozen=True)
class DriveProbe:
    """Settings of the probe of an actuator's force law, by small changes."""

    step: float = 1e-4
    """Change of input [its unit] and of position [rad, m]."""


@dataclass(frozen=True)
class Conditions:
    """Settings of rollouts that were recorded under conditions other than the declared ones."""

    relative: float = 1e-3
    """Relative difference of gains or voltages below which they are the same: rounding in a file is smaller."""
    most: int = 24
    """Conditions at most of which each has a model of its own in every simulation; it bounds memory."""


@dataclass(frozen=True)
class SimulationThresholds:
    """All of them."""

    windows: Windowing = field(default_factory=Windowing)
    history: ActuatorHistory = field(default_factory=ActuatorHistory)
    path: JointPath = field(default_factory=JointPath)
    base_height: BaseHeight = field(default_factory=BaseHeight)
    culling: CollisionCulling = field(default_factory=CollisionCulling)
    hidden: HiddenStates = field(default_factory=HiddenStates)
    solver: Solver = field(default_factory=Solver)
    drive: DriveProbe = field(default_factory=DriveProbe)
    conditions: Conditions = field(default_factory=Conditions)
