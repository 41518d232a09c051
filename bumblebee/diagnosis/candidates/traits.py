"""Facts that the diagnosis must know of each effect of the catalogue beside its equation: one row an effect.

A new effect of the catalogue needs a row here; without one nothing is imported. The rest: docs/adding-an-effect.md.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from bumblebee.sim.effects import CATALOGUE


@dataclass(frozen=True)
class Traits:
    """Facts about one kind of effect."""

    experiment: str = ""
    """Experiment that a person would do to tell it from effects that look the same."""
    on_fixed_base: str = ""
    """Experiment where the robot's base is bolted down, if it is another."""
    column: Literal["torque", "late", "simulated"] = "torque"
    """Where its sensitivity comes from: from a torque on the robot; from one to first order, which is poor for light
    joints of stiff servos; or from simulation alone, for no torque stands for it."""
    fine_steps: bool = False
    """Whether coarse steps would falsify it: they hit a backlash too softly and a limit too late, let feet touch
    otherwise, and late feedback, computed beside the integrator, moves a servo by itself. A tilt is not simulated."""
    inverse: bool = False
    """Whether the fit moves the inverse of its first parameter: where the effect is absent that is infinite."""
    costly: bool = False
    """Whether it is tried on the worst explained joints alone, where there are many."""
    abrupt: bool = False
    """Whether what it does grows with no power of its size, in few windows."""
    saturation: bool = False
    """Whether it is a limit, which only the windows feel that reach it."""
    judged_alone: bool = False
    """Whether it is judged with all others where they are, and refitted with them afterwards: the windows that feel it
    are few, and what moving the others changes in all the rest would decide. Its proposal has asked more windows than
    a fit has; those of the validation must not speak against it."""
    on_dry_friction: bool = False
    """Whether it is a friction that sits on a level, which is dry friction again."""
    usual: Literal["", "position", "joint", "torque", "robot", "body"] = ""
    """Whether every robot has it: every joint (`position`: only where drives are told positions, `torque`: only where
    they are told torques), the whole robot, or every link. PACE's set (Bjelonic et al. 2025: armature, damping,
    friction, offset, delay), the drive's strength and the servo's damping, which can be less than declared, as friction
    cannot. Of a drive that is told its torque gears rub with it, and an offset shows as a centre of mass does."""
    not_beside: tuple[str, ...] = ()
    """Effects that a joint cannot have as well: MJCF has one spring a joint, and one second hinge. Said on one side."""
    named_first: int = 0
    """Place in the order in which effects that fit equally are named, the most often met first; 0: after these."""


TRAITS: dict[str, Traits] = {
    "coulomb_friction": Traits("move at several speeds under several loads", usual="joint", named_first=1),
    "viscous_friction": Traits(
        "vary kd, or command a velocity: a servo's damping follows both, a joint's does not",
        usual="joint",
        named_first=2,
    ),
    "quadratic_friction": Traits("turn the unpowered joint at several constant speeds, fast ones among them"),
    "stribeck_friction": Traits("creep through zero speed", on_dry_friction=True),
    "load_dependent_friction": Traits("move at the same speed under two loads", usual="torque"),
    "armature": Traits(
        "accelerate the joint with the link taken off or with a known weight on it", usual="joint", named_first=3
    ),
    "motor_strength": Traits("hold a known load at rest, and vary kp and kd together", usual="joint", named_first=4),
    "kp": Traits("vary kp and hold a known load"),
    "kd": Traits("vary kd: an error of the gain grows with it, friction does not", usual="position"),
    "torque_limit": Traits("hold a growing load", fine_steps=True, saturation=True),
    "torque_speed_limit": Traits(
        "move fast without load and slowly under load", fine_steps=True, saturation=True, inverse=True
    ),
    "command_delay": Traits("command steps and log the torque", usual="robot", named_first=5),
    "command_filter": Traits("command a step and log the servo's own set-point, or its position at 500 Hz"),
    "command_rate_limit": Traits(
        "command steps of several sizes: a limited rate takes longer for a larger one",
        inverse=True,
        not_beside=("command_filter",),
    ),
    "command_profile": Traits(
        "command steps of several sizes: an acceleration that is limited takes longer by the root of the size",
        inverse=True,
        not_beside=("command_filter", "command_rate_limit"),
    ),
    "torque_lag": Traits("command steps and log the torque at 500 Hz", column="late", fine_steps=True),
    "encoder_delay": Traits("film the joint, or log a second encoder", column="late", fine_steps=True),
    "dropped_commands": Traits("log the commands as the drive receives them"),
    "encoder_offset": Traits(
        "move the joint against a stop of known angle", column="simulated", usual="position", named_first=6
    ),
    "imu_offset": Traits(
        "turn the robot by 180 degrees on the spot, on a levelled floor", column="simulated", fine_steps=True
    ),
    "encoder_quantisation": Traits("log at rest", fine_steps=True),
    "joint_spring": Traits("move the joint slowly through its whole range, unpowered"),
    "asymmetric_friction": Traits(
        "move the joint at the same speed both ways, with the joint's axis vertical", on_dry_friction=True
    ),
    "hysteresis": Traits("move to and fro by small angles", not_beside=("joint_spring", "asymmetric_friction")),
    "cogging": Traits("turn the unpowered joint slowly"),
    "backlash": Traits(
        "rock the joint with the motor held",
        column="simulated",
        fine_steps=True,
        abrupt=True,
        not_beside=("series_elasticity",),
    ),
    "series_elasticity": Traits(
        "load the joint with the motor held", column="simulated", fine_steps=True, inverse=True, costly=True
    ),
    "link_mass": Traits("add 2 kg to the link, or weigh it", usual="body", named_first=7),
    "link_com": Traits("hold the link still in several poses and log the torque", usual="body"),
    "link_inertia": Traits("swing the link fast about each axis"),
    "ground_friction": Traits("push a standing robot sideways until it slips", column="simulated", fine_steps=True),
    "ground_compliance": Traits("drop the robot's foot on the floor", column="simulated", fine_steps=True),
    "ground_slope": Traits(
        "turn the robot by 180 degrees on the spot",
        on_fixed_base="put a level on the mount, or bolt it down turned by 180 degrees",
    ),
    "surface_contact": Traits(
        "repeat the motion with the robot lifted off what it may touch, or with that taken away",
        column="simulated",
        abrupt=True,
        judged_alone=True,
    ),
    "thermal_fade": Traits("repeat the motion after a pause"),
    "strength_drift": Traits("repeat the motion after a pause, without one"),
    "external_wrench": Traits("unplug what is tethered, and repeat in another heading"),
    "discovered": Traits(),
}
if missing := CATALOGUE.keys() ^ TRAITS.keys():
    raise TypeError(
        f"bumblebee/diagnosis/candidates/traits.py: a row each for the catalogue's effects, not so: {missing}"
    )


def _kinds(*usual: str) -> tuple[str, ...]:
    return tuple(kind for kind, traits in TRAITS.items() if traits.usual in usual)


INVERSE = tuple(kind for kind, traits in TRAITS.items() if traits.inverse)
ABRUPT = tuple(kind for kind, traits in TRAITS.items() if traits.abrupt)
JUDGED_ALONE = tuple(kind for kind, traits in TRAITS.items() if traits.judged_alone)
SATURATIONS = tuple(kind for kind, traits in TRAITS.items() if traits.saturation)
SHAPED = tuple(kind for kind, traits in TRAITS.items() if traits.on_dry_friction)
USUAL = _kinds("joint", "position")
USUAL_OF_TORQUE = _kinds("joint", "torque")
USUAL_OF_ROBOT = _kinds("robot")
USUAL_OF_BODIES = _kinds("body")
IMU_TILT = "imu_offset"


def exclude(one: str, other: str) -> bool:
    """Whether a joint cannot have both."""
    return other in TRAITS[one].not_beside or one in TRAITS[other].not_beside


def experiment(kind: str, floating: bool) -> str:
    """Experiment that tells a kind from what looks the same, on a robot whose base is free or not."""
    return (not floating and TRAITS[kind].on_fixed_base) or TRAITS[kind].experiment


def naming_order(kind: str) -> int:
    """The place of a kind among effects that fit the same; the usual ones first."""
    return TRAITS[kind].named_first or max(traits.named_first for traits in TRAITS.values()) + 1


def rough(kinds: Iterable[str]) -> bool:
    """Whether coarse steps do for differences between models with these effects."""
    return not any(TRAITS[kind].fine_steps for kind in kinds)
