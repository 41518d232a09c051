"""The base of all effects: what the simulator, the diagnosis and the deployment ask of one, and what is so of most."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import mujoco
import numpy as np

from bumblebee.effects.law import Law
from bumblebee.effects.places import OnRobot, Spot, Step

INF = math.inf


@dataclass(frozen=True)
class Parameter:
    """One number of an effect."""

    name: str
    unit: str
    """"" for a factor or a share."""
    lower: float
    """Smallest value that is physical."""
    upper: float
    """Largest value that is sensible; infinite where only the data can tell."""
    default: float | None = None
    """Its value where an effect does not give it, and then not written either; None: it must be given."""
    choice: bool = False
    """Whether it is 0 or 1 and names a form of the effect, not a size: never fitted."""
    matters: float = 0.0
    """A change of it that matters wherever it shapes the effect; 0: that depends on the data."""


class Given(Protocol):
    """An effect with its values, `effects.catalogue.Effect`."""

    @property
    def where(self) -> tuple[str, ...]:
        """Joints, bodies or geoms that it sits on."""

    @property
    def parameters(self) -> dict[str, float]:
        """Its values by name."""

    def value(self) -> float:
        """Its first value."""

    def values(self) -> tuple[float, ...]:
        """All values, in the order of the parameters."""


class CannotUndo(Exception):
    """An effect that no drive can undo; the text is the reason."""


class Kind:
    """One effect of the catalogue. Its file has its name; what the file says of it stands in docs/effects.md.

    A subclass has attributes and methods of five parts: what it is; how the simulator carries it (`add` and `write`,
    or `hook` with `torque_at` for a torque without a memory); how the diagnosis looks for it; how it reads in terms;
    how the deployment undoes it.
    """

    on: Literal["joint", "body", "geom", "whole"] = "joint"
    """Part of the robot that it sits on."""
    base: bool = False
    """Whether that is the body of a floating base alone."""
    parameters: tuple[Parameter, ...] = ()
    """In the order of their arrays."""
    whole: bool = False
    """Whether `where: []` means all joints at once."""
    rank: int = 1000
    """Its place among the others, as they are listed and tried; without one after them, by name."""
    last: bool = False
    """Whether it is put into a model after the others, for it goes by a gain or a spring that these may change."""
    beside: tuple[str, ...] = ()
    """Effects that a joint cannot have as well: MJCF has one spring a joint, and one second hinge. Said on one side."""

    # In the simulator
    native: bool = True
    """Whether plain MJCF carries it; else (or in part) a runtime hook does."""
    hooked: str = ""
    """A parameter that makes of it, where it is not zero, a form that MJCF does not carry."""
    structural: bool = False
    """Whether it changes the layout of MuJoCo's state, or the geometry."""
    stateless: bool = False
    """Whether a structural one has no state, so that nothing of it must be guessed where a window starts."""
    constants: bool = False
    """Whether MuJoCo must work out its constants anew when it is written, as after all that is structural."""
    absent: float | tuple[float, ...] | None = None
    """Where it is not there, if no model declares it: 0, a factor of 1, an infinite limit."""

    # In the diagnosis
    drive: Literal["", "any", "scaled", "position"] = ""
    """Drive that a joint needs for it: none, any, one whose gain is known, one of these that is told positions."""
    experiment: str = ""
    """Experiment that a person would do to tell it from effects that look the same."""
    on_fixed_base: str = ""
    """Experiment where the robot's base is bolted down, if it is another."""
    column: Literal["torque", "late", "simulated"] = "torque"
    """Where its sensitivity comes from: from a torque on the robot; from one to first order, which is poor for light
    joints of stiff servos; or from simulation alone, for no torque stands for it."""
    on_two_joints: bool = False
    """Whether its torque is on another joint as well: `torque` then gets `Signatures`, as of what sits on a body."""
    standard: Literal["", "joint", "drive", "link"] = ""
    """Whose standard parameter it is: its torque is its size times what the motion says. Where torques and masses are
    both unknown nothing fixes their scale, so that of drives and links one is asked at a time."""
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
    usual: Literal["", "joint", "robot", "body"] = ""
    """Whether every robot has it: every joint, the whole robot, or every link. PACE's set (Bjelonic et al. 2025:
    armature, damping, friction, offset, delay), the drive's strength and the servo's damping, which can be less than
    declared, as friction cannot."""
    named_first: int = 0
    """Place in the order in which effects that fit equally are named, the most often met first; 0: after these."""
    law: Law | str = ""
    """Its law in terms, or why there is none."""

    # In the deployment
    not_undone: str = ""
    """Why no drive can undo it at the joint."""

    @property
    def id(self) -> str:
        """Its name, which is that of its file."""
        return type(self).__module__.rpartition(".")[2]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its parameters."""
        return tuple(p.name for p in self.parameters)

    @property
    def added(self) -> bool:
        """Whether MJCF carries something of it."""
        return self.has("add")

    @property
    def hooks(self) -> bool:
        """Whether MJCF lacks something of it, in one of its forms."""
        return self.has("hook") or self.has("torque_at")

    def has(self, method: str) -> bool:
        """Whether the effect has a method of its own."""
        return getattr(type(self), method) is not getattr(Kind, method)

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        """Put it into a spec, in place.

        Raises:
            BadInput: if the spec has no such place, or what it has there does not go with it.
        """
        raise NotImplementedError

    def write(self, spot: Spot, *values: float) -> None:
        """Write into a compiled model what `add` does to a spec."""
        raise NotImplementedError

    def hook(self, making: Any, effect: Given) -> None:
        """Add it to the hooks in the making, `sim.effects.hooks.Making`; by default as a torque, see `torque_at`."""
        making.laws(self, effect)

    def torque_at(self, q: Any, v: Any, *values: float) -> Any:
        """Torque (n,) [N m] beside the servo on joints at `q` [rad] with `v` [rad/s], arrays of NumPy or a device's."""
        raise NotImplementedError

    def reshapes(self, values: Sequence[float]) -> bool:
        """Whether it is structural with these parameters."""
        return self.structural

    def declared(self, spot: Spot) -> Sequence[float] | np.ndarray:
        """Its first parameters as a model has them, infinite where that knows no bound; the others are 0."""
        return np.atleast_1d(self.absent)  # type: ignore[arg-type]

    def steps(self, on: Any) -> Iterator[Step]:
        """Candidates on an `OnJoint`, `OnBody` or, on the whole robot, an `OnRobot`."""
        yield from ()

    def steps_together(self, on: OnRobot) -> Iterator[Step]:
        """Candidates on all joints at once."""
        yield from ()

    def bounds(self, nominal: Sequence[float], limits: Any) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest parameters (P,), by `diagnosis.thresholds.candidates.CandidateLimits`."""
        return np.array([p.lower for p in self.parameters]), np.array([p.upper for p in self.parameters])

    def physical(self, values: np.ndarray) -> np.ndarray:
        """Parameters (P,) within bounds, as a body can have them together."""
        return values

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray] | np.ndarray:
        """Torques for one step of each of the F free parameters of the candidate `c`.

        Args:
            along: on a joint, `AlongJoint` of `diagnosis.sensitivities.torque_signatures`, and the torques are (W, K),
                those of the joint in each step; else `Signatures`, and they are (F, W, S, nv).
            c: a `Candidate`.
        """
        raise ValueError(
            f'{self.id} has no torque: give bumblebee/effects/.../{self.id}.py a method torque, or column="simulated"'
        )

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        """Put it into `compensation.draft.Draft` on the joints `columns`: what is done, with which numbers.

        Raises:
            CannotUndo: if it cannot be undone at the joint.
        """
        raise CannotUndo(self.not_undone)
