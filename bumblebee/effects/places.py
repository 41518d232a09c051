"""Where an effect sits: in a compiled model, and in the data that its first steps follow from."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np


@dataclass(frozen=True, eq=False)
class Spot:
    """A place in a compiled model from which an effect is read or into which it is written; J joints, A actuators."""

    model: mujoco.MjModel
    place: str
    """A joint, body or geom; "" for the whole robot."""
    joints: tuple[str, ...]
    """Names of the J joints."""
    dofs: np.ndarray
    """(J,) their addresses in qvel."""
    actuators: np.ndarray
    """(J,) ids of their drives; -1 for none."""
    delay: np.ndarray
    """(A,) age of the commands [s]."""
    offset: np.ndarray
    """(J,) added to the encoders' readings [rad]."""
    supply: float
    """Supply voltage as a share of the nominal one."""

    @property
    def column(self) -> int:
        """Column of the joint."""
        return self.joints.index(self.place)

    @property
    def dof(self) -> int:
        """Address of the joint in qvel."""
        return int(self.dofs[self.column])

    @property
    def joint(self) -> int:
        """Id of the joint."""
        return int(self.model.dof_jntid[self.dof])

    @property
    def actuator(self) -> int:
        """Id of the joint's drive; -1 for none."""
        return int(self.actuators[self.column])

    @property
    def body(self) -> int:
        """Id of the body."""
        return int(self.model.body(self.place).id)

    @property
    def geom(self) -> int:
        """Id of the geometry."""
        return int(self.model.geom(self.place).id)


@dataclass(frozen=True)
class Step:
    """First step of an effect's parameters (P,), as a candidate."""

    step: tuple[float, ...]
    """Changes that matter, of the sign that the effect usually has."""
    free: tuple[int, ...] = (0,)
    """Parameters that the effect is tested in; of the others those with a step shape it."""
    start: tuple[float, ...] | None = None
    """Where it is absent; None: where the declared model has it."""
    shape: float = 0.0
    """A change of its shape that matters; 0: the shape is not fitted."""


@dataclass(frozen=True, eq=False)
class OnJoint:
    """A joint with typical sizes of its data."""

    spot: Spot
    before: str
    """The joint before it on its chain, if that has a drive and moves; else ""."""
    rules: Any
    """`diagnosis.thresholds.candidates.CandidateThresholds`."""
    torque: float
    """Torque of a first step [N m]."""
    peak: float
    """Largest torque of its servo [N m]."""
    speed: float
    """RMS speed [rad/s]."""
    fastest: float
    """Largest speed [rad/s]."""
    travel: float
    """Range of its positions [rad]."""
    inertia: float
    """Diagonal of the joint-space inertia [kg m^2]."""
    target_rate: float
    """Largest change of its targets a second [rad/s]; 0 where torques are logged."""
    target_turn: float
    """Largest change of that a second [rad/s^2]."""
    duration: float
    """Longest rollout [s]."""

    @property
    def hinge(self) -> bool:
        """Whether it turns."""
        return int(self.spot.model.jnt_type[self.spot.joint]) == int(mujoco.mjtJoint.mjJNT_HINGE)

    @property
    def ends_its_body(self) -> bool:
        """Whether no other joint lies between it and its body: behind it alone there is room for a second hinge."""
        model, joint = self.spot.model, self.spot.joint
        body = int(model.jnt_bodyid[joint])
        return joint == int(model.body_jntadr[body] + model.body_jntnum[body]) - 1


@dataclass(frozen=True, eq=False)
class OnBody:
    """A body, or a geometry, and the robot that it belongs to."""

    spot: Spot
    rules: Any
    """`diagnosis.thresholds.candidates.BodySteps`."""

    @property
    def mass(self) -> float:
        """[kg]."""
        return float(self.spot.model.body_mass[self.spot.body])

    @property
    def moments(self) -> np.ndarray:
        """Principal moments (3,) [kg m^2]."""
        return self.spot.model.body_inertia[self.spot.body]

    @property
    def heavy(self) -> float:
        """Mass of a first step [kg]."""
        return max(self.rules.mass * self.mass, self.rules.least_mass * float(self.spot.model.body_mass.sum()))


@dataclass(frozen=True, eq=False)
class OnRobot:
    """A whole robot."""

    model: mujoco.MjModel
    rules: Any
    """`diagnosis.thresholds.candidates.CandidateThresholds`."""
    delays: np.ndarray
    """(D,) declared age of its drives' commands [s]."""
