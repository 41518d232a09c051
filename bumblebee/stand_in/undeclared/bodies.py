"""Laws of masses, of the ground and of forces from outside."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from bumblebee.stand_in.undeclared.law import Law, World


@dataclass
class Mass(Law):
    """A body of `mass` [kg]; the load sits at its centre of mass, its inertia stays."""

    body: str
    mass: float

    def model(self, model: mujoco.MjModel) -> None:
        """The field."""
        model.body_mass[model.body(self.body).id] = self.mass


@dataclass
class Com(Law):
    """A body whose centre of mass lies `shift` [m] further along `axis` of the body's frame."""

    body: str
    axis: int
    shift: float

    def model(self, model: mujoco.MjModel) -> None:
        """The field."""
        model.body_ipos[model.body(self.body).id, self.axis] += self.shift


@dataclass
class Inertia(Law):
    """A body whose three principal moments are `factor` times the declared ones."""

    body: str
    factor: float

    def model(self, model: mujoco.MjModel) -> None:
        """The field."""
        model.body_inertia[model.body(self.body).id] *= self.factor


@dataclass
class GroundFriction(Law):
    """Sliding friction `value` between every foot and the floor."""

    value: float

    def model(self, model: mujoco.MjModel) -> None:
        """MuJoCo takes the larger of the two geoms' values: both are set."""
        model.geom_friction[:, 0] = self.value


@dataclass
class GroundCompliance(Law):
    """Contacts with the time constant `constant` [s]."""

    constant: float

    def model(self, model: mujoco.MjModel) -> None:
        """Set the contact constant of all geoms, for MuJoCo mixes the two."""
        model.geom_solref[:, 0] = self.constant


@dataclass
class Slope(Law):
    """A floor that rises by `angle` [rad] towards `axis` (0 ahead, 1 left); the world's frame lies in the floor."""

    axis: int
    angle: float

    def model(self, model: mujoco.MjModel) -> None:
        """Gravity leans instead."""
        g = np.linalg.norm(model.opt.gravity)
        lean = np.zeros(3)
        lean[self.axis], lean[2] = -np.sin(self.angle), -np.cos(self.angle)
        model.opt.gravity[:] = g * lean


@dataclass
class Wrench(Law):
    """A constant force [N] on a body's centre of mass, world frame."""

    body: int
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def push(self, world: World, wrench: np.ndarray) -> None:
        """Added."""
        wrench[:, self.body, :3] += self.force
