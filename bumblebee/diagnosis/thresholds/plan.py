"""Numbers that the plan of the next experiment goes by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class SafetyMargins:
    """How far a planned motion stays from what the robot can take."""

    travel: float = 0.05
    """Share of a joint's range that is kept free at either end: targets and simulated positions stay inside."""
    speed: float = 0.9
    """Share of the speed limit that may be reached in simulation."""
    torque: float = 0.9
    """Share of the torque limit that the drive may be asked for: at the limit the robot is no longer where it is told.
    """
    still: float = 0.05
    """Speed [rad/s, m/s] below which a joint counts as at rest at the start and at the end."""
    clearance: float = 0.01
    """Distance [m] that bodies keep; those that are nearer at the start do not touch, those that touch there may."""
    every: float = 0.04
    """Time between two looks for contacts [s]: at 2 m/s a body comes 8 cm in it, and margins are checked, not impacts.
    """
    tilt: float = 0.1
    """Angle [rad] by which a standing robot's base may turn away from how it stands at rest."""
    slide: float = 0.01
    """Distance [m] that a foot may slide."""
    support: float = 0.2
    """Share of the support polygon's inner radius that centre of mass and zero-moment point keep from its edge."""
    weight: float = 0.5
    """Share of a standing robot's weight that the floor carries at least: with less its feet are about to lift."""
    touch: float = 0.001
    """Gap [m] below which a foot's point counts as in contact: soft contacts give by as much."""


@dataclass(frozen=True)
class Unknowns:
    """Ranges that a plan must be safe under where no diagnosis says what the robot is like."""

    strength: tuple[float, float] = (0.8, 1.2)
    """Factors on all drives' strength: torque constants of a catalogue differ by as much from unit to unit."""
    mass: float = 1.2
    """Factor on all masses: cables, covers and grippers that no description has."""
    delay: float = 0.015
    """Delay of all commands [s]: a slow field bus."""
    friction: float = 0.05
    """Dry friction of each joint as a share of its torque limit."""
    rivals: int = 6
    """Other explanations of an effect that a plan is rehearsed with, the nearest first."""
    same: float = 0.01
    """Share of an effect's change within which the end of its interval is the diagnosed robot again."""
    beyond: float = 2.0
    """Times an effect's change that stands for an interval without an end."""
    windows: int = 24
    """Windows of the data on which robots that it may be are held against the diagnosed one."""
    share: float = 0.25
    """Share of a joint's motion in these windows by which a robot errs at least that is not this one."""
    worse: float = 1.5
    """Times the diagnosed robot's error on the same joint, likewise."""
    named: int = 6
    """Robots of one reason that a note names: where a diagnosis knows little there are dozens."""


@dataclass(frozen=True)
class Motions:
    """Thresholds for the candidate motions."""

    lead: float = 0.5
    """Rest in the start pose before a run [s]."""
    ramp: float = 0.8
    """Time in which an excitation grows from rest, and dies to it [s]."""
    rest: float = 0.7
    """Rest in the start pose at the end [s]."""
    settle: float = 2.0
    """Time that the robot is held in the start pose before a rehearsal [s]: it sags until its servos bear it."""
    rates: tuple[tuple[float, float], ...] = ((0.1, 0.5), (0.3, 1.2), (0.8, 2.5))
    """Bands of frequencies of a multisine [Hz]: slow ones feel friction and gravity, fast ones inertia and delays."""
    harmonics: int = 4
    """Sines a joint."""
    reach: tuple[float, float] = (0.25, 0.95)
    """Share of the free travel that a motion uses before limits shrink it."""
    support_reach: float = 0.12
    """Share of the free travel for joints between a standing robot's base and its feet."""
    rocking: tuple[float, float] = (0.01, 0.05)
    """Half-width of small reversals [rad, m]: what backlash and hysteresis show in."""
    jumps: tuple[float, float] = (0.01, 0.06)
    """Half-height of jumps of the target [rad, m]: at a stiff servo's gain a fraction of its torque."""
    mostly: float = 0.8
    """Share of the time in which targets are no faster than the speed limit before a rehearsal: jumps are rarer."""
    shrink: float = 0.75
    """Factor on the amplitude of a motion that is not safe."""
    shrinks: int = 12
    """Times that a motion is made smaller before it is given up: 0.75^12 is a thirtieth."""


@dataclass(frozen=True)
class TrackingGains:
    """Gains of the servo that follows a plan's targets on a robot with torque drives and unknown gains."""

    frequency: float = 2.0
    """Natural frequency of the joint's inertia on the servo [Hz]: soft, and above most of the planned motion."""
    damping: float = 0.7
    """Damping ratio."""


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations where no dataset says them; an ordinary encoder, IMU and odometry."""

    joint_pos: float = 5e-4
    """[rad, m]."""
    joint_vel: float = 0.02
    """[rad/s, m/s]."""
    base_rot: float = 0.002
    """[rad]."""
    base_ang_vel: float = 0.01
    """[rad/s]."""
    base_lin_vel: float = 0.02
    """[m/s]."""
    base_pos: float = 0.001
    """[m]."""


@dataclass(frozen=True)
class Information:
    """Thresholds for expected information from simulated windows."""

    windows: int = 12
    """Windows of a run that stand for all of its windows."""
    few: int = 6
    """Windows of a run for models of many degrees of freedom, where each costs a third of a second."""
    together: int = 12
    """Runs that are whitened at once: memory, a window of a humanoid has a factor of a megabyte."""
    prior: float = 10.0
    """Standard deviation, in first steps, of what is known of an effect before any data: next to nothing."""
    usual: tuple[str, ...] = (
        "coulomb_friction",
        "viscous_friction",
        "armature",
        "motor_strength",
        "kp",
        "kd",
        "command_delay",
        "encoder_offset",
        "joint_spring",
        "load_dependent_friction",
        "asymmetric_friction",
        "stribeck_friction",
        "link_mass",
        "link_com",
    )
    """Effects that any robot may have, which are asked about whatever a diagnosis found."""
    fitted: tuple[str, ...] = (
        "coulomb_friction",
        "viscous_friction",
        "armature",
        "motor_strength",
        "command_delay",
        "encoder_offset",
        "link_mass",
    )
    """Those of a joint and its body that widths are computed for, together: PACE's set, strength and mass."""
    confused: tuple[tuple[str, str], ...] = (
        ("viscous_friction", "kd"),
        ("motor_strength", "kp"),
        ("motor_strength", "link_mass"),
        ("kp", "joint_spring"),
        ("kp", "encoder_offset"),
        ("joint_spring", "encoder_offset"),
        ("joint_spring", "link_com"),
        ("coulomb_friction", "viscous_friction"),
        ("coulomb_friction", "stribeck_friction"),
        ("coulomb_friction", "load_dependent_friction"),
        ("coulomb_friction", "asymmetric_friction"),
        ("armature", "link_mass"),
        ("armature", "command_delay"),
        ("kd", "command_delay"),
        ("viscous_friction", "command_delay"),
    )
    """Pairs that poor data take for each other most, on one joint or on the body that it moves."""


@dataclass(frozen=True)
class Choice:
    """Thresholds for the runs that are chosen."""

    enough: float = 100.0
    """Chi-square that tells two effects apart in practice, ten standard errors: the diagnosis asks for about six, on
    validation windows, which are a part of the data."""
    cosine: float = 0.99
    """Cosine between what is there and the best that a rival can do, below which two effects count as told apart:
    what is left of nearer ones may be what an integrator makes of them, as with viscous friction and kd at one gain."""
    classes: float = 1.0
    """Weight of a class of effects that the data cannot tell apart; a class that is told apart counts as 1."""
    intervals: float = 0.3
    """Weight of halving the mean width of the found effects' intervals."""
    usual: float = 0.1
    """Weight of halving the mean width of those of all usual effects: what was named may be the wrong name."""
    exchanges: int = 3
    """Passes in which each chosen run is held against all others."""


@dataclass(frozen=True)
class PlanThresholds:
    """All of them."""

    safety: SafetyMargins = field(default_factory=SafetyMargins)
    unknowns: Unknowns = field(default_factory=Unknowns)
    motions: Motions = field(default_factory=Motions)
    tracking: TrackingGains = field(default_factory=TrackingGains)
    noise: SensorNoise = field(default_factory=SensorNoise)
    information: Information = field(default_factory=Information)
    choice: Choice = field(default_factory=Choice)
