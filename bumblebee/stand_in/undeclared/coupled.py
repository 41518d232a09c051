"""Laws of motors that turn with two joints, a joint and its neighbour nearer the base, by their sum or difference."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.stand_in.undeclared.kind import Kind, Made, Place
from bumblebee.stand_in.undeclared.law import Law, World

_RATIOS = (1.0, 0.6, 1.5)
_WAYS = {1: "sum", -1: "difference"}


@dataclass
class CoupledFriction(Law):
    """Dry friction `level` [N m] on the rate of q + `ratio` q_neighbour; the ratio is negative for the difference."""

    joint: str
    neighbour: str
    ratio: float
    level: float

    def spec(self, spec: mujoco.MjSpec) -> None:
        """A fixed tendon that rubs."""
        rope = _rope(spec, self.joint, self.neighbour, self.ratio)
        rope.frictionloss, rope.solref_friction = self.level, [0.004, 1.0]
        rope.solimp_friction = [0.999, 0.999, 0.001, 0.5, 2.0]


@dataclass
class CoupledDamping(Law):
    """Torque -`damping` (v + `ratio` v_neighbour) [N m s/rad] on the joint, `ratio` times that on the neighbour."""

    joint: str
    neighbour: str
    ratio: float
    damping: float

    def passive(self, world: World, push: np.ndarray) -> None:
        """Linear in the motor's speed."""
        one, other = world.column(self.joint), world.column(self.neighbour)
        torque = -self.damping * (world.v[:, one] + self.ratio * world.v[:, other])
        push[:, one] += torque
        push[:, other] += self.ratio * torque


@dataclass
class CoupledArmature(Law):
    """A rotor of inertia `rotor` [kg m^2] that turns by q + `ratio` q_neighbour."""

    joint: str
    neighbour: str
    ratio: float
    rotor: float

    def spec(self, spec: mujoco.MjSpec) -> None:
        """A fixed tendon that is heavy."""
        _rope(spec, self.joint, self.neighbour, self.ratio).armature = self.rotor


def _rope(spec: mujoco.MjSpec, joint: str, neighbour: str, ratio: float) -> mujoco.MjsTendon:
    rope = spec.add_tendon(name=f"{joint}_and_{neighbour}")
    rope.wrap_joint(joint, 1.0)
    rope.wrap_joint(neighbour, ratio)
    return rope


def _rubs(law: Callable[[str, str, float, float], Law]) -> Callable[[Place, float], Made]:
    def make(p: Place, s: float) -> Made:
        ratio, way = _RATIOS[p.draw["axis"]], _WAYS[p.draw["sign"]]
        sizes = {other: s * (other == way) for other in _WAYS.values()}
        return law(p.name, p.robot.chained[p.name], p.draw["sign"] * ratio, s), {**sizes, "ratio": ratio}

    return make


def _linear(law: Callable[[str, str, float, float], Law], name: str) -> Callable[[Place, float], Made]:
    def make(p: Place, s: float) -> Made:
        ratio = p.draw["sign"] * _RATIOS[p.draw["axis"]]
        return law(p.name, p.robot.chained[p.name], ratio, s), {name: s, "ratio": ratio}

    return make


KINDS = (
    Kind("coupled_friction", "pair", _rubs(CoupledFriction),
         first=lambda p: 0.01 * p.of(p.robot.limit), most=lambda p: 0.15 * p.of(p.robot.limit), robots="arm",
         unit="N m"),
    Kind("coupled_damping", "pair", _linear(CoupledDamping, "damping"),
         first=lambda p: 0.03 * p.of(p.robot.kd), most=lambda p: p.of(p.robot.kd), robots="arm", unit="N m s/rad"),
    Kind("coupled_armature", "crossed", _linear(CoupledArmature, "armature"),
         first=lambda p: 0.2 * p.of(p.robot.armature), most=lambda p: 4.0 * p.of(p.robot.armature), robots="arm",
         unit="kg m^2"),
)  # fmt: skip
