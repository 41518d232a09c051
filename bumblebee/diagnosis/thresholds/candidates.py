"""Numbers that the candidates go by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class StillJoints:
    """Thresholds for joints of which nothing can be said."""

    place: float = 2.5
    """Times its noise that a position must vary to move."""
    speed: float = 1.5
    """Times its noise that a velocity must vary to move."""


@dataclass(frozen=True)
class SignalScales:
    """Typical sizes of signals that first steps follow from."""

    torque: float = 0.05
    """Share of the largest joint's torque that each has at least: a joint that rests has none of its own."""
    speed: float = 0.1
    """Share of the largest joint's speed that each has at least."""
    peak: float = 0.995
    """Quantile that is the largest torque or speed: a single reading may be wrong."""
    rows: int = 50
    """Rows of a rollout at which inertia is asked for, and gravity on joints without a drive."""


@dataclass(frozen=True)
class JointSteps:
    """First steps on a joint, from the sizes of its own signals."""

    torque: float = 0.1
    """Share of the typical torque: friction, springs."""
    inertia: float = 0.1
    """Share of the joint's inertia: armature."""
    stribeck: tuple[float, ...] = (0.3, 1.0)
    """Shares of the typical speed at which Stribeck's friction ends."""
    shape: float = 0.3
    """Share of a width or speed that is a change of shape which matters; of cogging over the travel."""
    spring_travel: float = 0.05
    """Travel [rad, m] at least that a spring is sized by."""
    width: tuple[float, ...] = (0.03, 0.2)
    """Shares of the travel over which hysteresis builds up."""
    travel: float = 0.02
    """Travel [rad, m] at least that hysteresis and shafts are sized by."""
    cogging: float = 0.5
    """Share of the step of friction: sine and cosine of cogging."""
    harmonics: tuple[int, ...] = (
        *range(1, 25), 28, 30, 32, 36, 40, 42, 48, 50, 56, 60, 64, 72, 80, 84, 96, 100, 120, 128, 144,
    )  # fmt: skip
    """Periods of cogging in a turn: slots and poles of usual motors, and what gears make of them."""
    offset: float = 0.01
    """Encoder offset [rad, m]."""


@dataclass(frozen=True)
class DriveSteps:
    """First steps of what a drive does."""

    load: float = 0.05
    """Load-dependent friction: share of the torque."""
    time: float = 0.005
    """Command delay, torque lag, encoder delay [s]."""
    target_rate: tuple[float, ...] = (0.6, 0.2)
    """Shares of the targets' steepest course at which a limit of their rate is tried."""
    target_turn: tuple[tuple[float, float], ...] = ((1.0, 0.0), (0.2, 0.0), (0.5, 0.5))
    """Shares of their largest acceleration, and of their steepest course (0: no limit), at which a profile is tried."""
    dropped: float = 0.2
    """Share of commands lost."""
    gain: float = -0.1
    """Relative change of strength and gains."""
    fade: float = 0.1
    """Strength lost over the longest rollout."""
    limit: tuple[float, ...] = (0.9, 0.6, 0.35)
    """Shares of the largest torque at which a limit is tried."""
    speed_limit: tuple[float, ...] = (0.6, 1.5, 4.0)
    """Times the largest speed at which a drive has no torque left."""


@dataclass(frozen=True)
class TransmissionSteps:
    """First steps of backlash and flexible shafts."""

    backlash: float = 0.01
    """Share of the travel."""
    least_backlash: float = 0.002
    """Backlash at least [rad, m]."""
    twist: float = 0.02
    """Share of the travel that a shaft twists under the largest torque."""
    stiff: float = 0.03
    """Share of a servo's own compliance at most: one that reads the joint behind a soft shaft would swing it up."""
    damping: float = 1e-3
    """Damping of a shaft over its stiffness [s]."""
    damping_shape: float = 3e-4
    """Change of it that matters [s]."""
    link_share: float = 0.1
    """Link-side inertia fraction: share of the rotor's inertia behind the shaft."""


@dataclass(frozen=True)
class BodySteps:
    """First steps of bodies, of the ground and of what the robot stands by."""

    mass: float = 0.2
    """Share of the body's mass."""
    least_mass: float = 0.01
    """Share of the robot's mass at least; as a force also that of a wrench."""
    com: float = 0.1
    """Share of the body's size by which its centre of mass moves."""
    least_com: float = 0.01
    """Length [m] by which a centre of mass moves at least."""
    moments: float = 0.3
    """Share of the body's moments of inertia."""
    least_moment: float = 1e-5
    """Added to that [kg m^2], for a moment may be declared as none."""
    slope: float = 0.01
    """Slope of the ground [rad]."""
    tilt: float = 0.01
    """Tilt of the base's sensor [rad]."""
    ground_friction: float = -0.1
    """Relative change of the ground's friction."""
    ground_compliance: float = 0.2
    """Relative change of the ground's compliance."""


@dataclass(frozen=True)
class SurfaceSteps:
    """First steps of a surface that a body of a robot on a fixed base touches."""

    ticks: int = 25
    """Every n-th tick of the logs shows how low a body comes."""
    travel: float = 0.02
    """Height through which a body must move [m]."""
    below: float = 0.01
    """How far below its lowest place no surface is felt [m]."""
    deep: float = 0.1
    """Share of that height by which a first surface is above its lowest place."""
    friction: float = 0.5
    """Sliding friction to begin with."""


@dataclass(frozen=True)
class CandidateLimits:
    """Limits of one candidate: how it is simulated and how far it may go."""

    few_joints: int = 8
    """Joints up to which lags and shafts are simulated on all; on more a lag is taken for a torque.

    To first order it is a torque and a start that moved, which for the light joints of a stiff servo is a poor
    likeness.
    """
    shapes: int = 2
    """Shapes of one kind on one place that are tried beside each other."""
    stiffest: float = 0.02
    """Share of the first step that a compliance or an inverse speed has at least: as good as absent, while none at all
    cannot be simulated."""
    point: float = 0.01
    """Share of its declared moments that a link keeps: what moments near zero say is lost to their bound."""
    contact_friction: float = 1.0
    """Friction of a contact at most: short windows hold it by little, and a hand that sticks swings later."""


@dataclass(frozen=True)
class CandidateThresholds:
    """All of them."""

    still: StillJoints = field(default_factory=StillJoints)
    scales: SignalScales = field(default_factory=SignalScales)
    joint: JointSteps = field(default_factory=JointSteps)
    drive: DriveSteps = field(default_factory=DriveSteps)
    transmission: TransmissionSteps = field(default_factory=TransmissionSteps)
    body: BodySteps = field(default_factory=BodySteps)
    surface: SurfaceSteps = field(default_factory=SurfaceSteps)
    limits: CandidateLimits = field(default_factory=CandidateLimits)
