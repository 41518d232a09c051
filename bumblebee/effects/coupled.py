"""Motors that turn with two joints, as in the wrists of industrial arms and the ankles and waists of humanoids.

In MJCF they are fixed tendons, whose length is an angle of the motor: a joint's angle and `ratio` times that of the
joint before it on its chain, which is less than 0 where it turns with their difference. MuJoCo gives a tendon friction,
damping and inertia. Of what is linear in the motion, motors of the sum and of the difference together are no more than
the joints' own beside one of the two; of dry friction they are.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.bare import bare_tendon
from bumblebee.effects.hinges import joint_of
from bumblebee.effects.kind import Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.native import is_hidden
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.errors import BadInput

_OF_ONE_ANGLE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def ratio_from(least: float) -> Parameter:
    """How far a motor turns with the joint before, of how far with its own."""
    return Parameter("ratio", "", least, 20.0, 1.0, matters=0.1)


class Coupled(Kind, ABC):
    """An effect of motors that turn with a joint and the one before it."""

    ways: tuple[float, ...] = (1.0,)
    """Sign of the ratio, of each motor."""
    absent = 0.0
    structural = stateless = on_two_joints = True
    standard = "joint"
    drive = "any"
    law = OF_ONE_JOINT
    not_undone = "it is a torque on two joints at once, and what is sent is made joint by joint"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        """A fixed tendon along both joints for each motor."""
        *sizes, ratio = values
        before = _before_in(spec, place)
        for way, size in zip(self.ways, sizes, strict=True):
            tendon = bare_tendon(spec, name=self._tendon(place, way))
            tendon.wrap_joint(before, way * ratio)
            tendon.wrap_joint(place, 1.0)
            self.give(tendon, size)

    def write(self, spot: Spot, *values: float) -> None:
        """Sizes and ratio of these tendons."""
        *sizes, ratio = values
        for way, size in zip(self.ways, sizes, strict=True):
            tendon = spot.model.tendon(self._tendon(spot.place, way)).id
            self.sizes(spot.model)[tendon] = size
            spot.model.wrap_prm[spot.model.tendon_adr[tendon]] = way * ratio

    def steps(self, on: OnJoint) -> Iterator[Step]:
        """Both motors at once, or one for the sum and one for the difference, after a driven joint that moves."""
        motors = len(self.ways)
        signs = (1.0, -1.0) if motors == 1 else (1.0,)
        for sign in signs if on.before else ():
            sizes = (self.size(on),) * motors
            yield Step((*sizes, sign), free=tuple(range(motors)), start=(0.0,) * (motors + 1), shape=1.0)

    @abstractmethod
    def give(self, tendon: Any, size: float) -> None:
        """Give it to a tendon of a spec."""

    @abstractmethod
    def sizes(self, model: mujoco.MjModel) -> np.ndarray:
        """Its sizes on a model's tendons."""

    @abstractmethod
    def size(self, on: OnJoint) -> float:
        """A first step of what either motor has."""

    def felt(self, along: Any, j: int) -> np.ndarray:
        """(W, K) what of a joint's motion it answers to."""
        return along.v[..., j]

    def answer(self, along: Any, motion: np.ndarray) -> np.ndarray:
        """Torque (W, K) of a size of 1 on a motor that moves so."""
        return -motion

    def torque(self, along: Any, c: Any) -> np.ndarray:
        """Torques (F, W, S, nv) of each motor on both joints, from `Signatures`."""
        joints = along.plant.joints
        j, before = joints.index(c.where), joints.index(joint_before(along.plant.model, c.where))
        out = []
        for f, way in zip(c.free, self.ways, strict=True):
            ratio = way * c.start[-1]
            given = c.step[f] * along.path.mean(
                self.answer(along, self.felt(along, j) + ratio * self.felt(along, before))
            )
            torque = np.zeros((*given.shape, along.plant.model.nv))
            torque[..., along.plant.dof[j]], torque[..., along.plant.dof[before]] = given, ratio * given
            out.append(torque)
        return np.stack(out)

    def _tendon(self, joint: str, way: float) -> str:
        return f"{joint}_{self.id}" + "_difference" * (way < 0)


def joint_before(model: mujoco.MjModel, name: str) -> str:
    """The hinge or slide before a joint on its chain: on its body, or on the nearest one that carries it; "": none."""
    joint = model.joint(name).id
    body = int(model.jnt_bodyid[joint])
    while body:
        first = int(model.body_jntadr[body])
        for other in range(min(joint, first + int(model.body_jntnum[body])) - 1, first - 1, -1):
            found = model.joint(other).name
            if not is_hidden(found):
                return found if model.jnt_type[other] in _OF_ONE_ANGLE else ""
        body = int(model.body_parentid[body])
    return ""


def _before_in(spec: mujoco.MjSpec, name: str) -> str:
    """`joint_before` of a spec; `BadInput` where there is none."""
    joint_of(spec, name)
    if not (before := joint_before(spec.compile(), name)):
        raise BadInput(f"effect on joint {name!r}", "a joint with another one before it on its chain", "none before it")
    return before
