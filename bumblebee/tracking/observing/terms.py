"""The terms of observations: small functions of one control step, by name (paper, appendix A, "Observation").

Suffixes name frames: `_b` the robot's base, `_g` the axes of the world with the robot's root as origin. The paper's
targets "in the global coordinates" are taken in the latter: nothing may depend on where in the world a clip plays.
`docs/decisions/paper-task.md` says what else the paper leaves open.
"""

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.robot.facts import KEY_BODIES, joint_names
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import conjugate, matrix, multiply, turned
from bumblebee.tracking.observing.imu import imu_layout, observe_imu
from bumblebee.tracking.observing.noise import LEVELS
from bumblebee.tracking.observing.observations import layout, observe
from bumblebee.tracking.sampling.library import ReferenceFrame, over_robot

Part = tuple[str, int]
"""Name and size of a stretch of an observation."""


@dataclass(frozen=True)
class Seen:
    """Inputs of a term.

    The state now, the reference at the end of the coming control period, the last action (B, J), the inverse of the
    base's orientation (B, 4), and `to_base` (B, 3, 3), which turns vectors of the world into the base frame.
    """

    state: RobotState
    ref: ReferenceFrame
    last_action: Tensor
    inverse: Tensor
    to_base: Tensor

    @classmethod
    def of(cls, state: RobotState, ref: ReferenceFrame, last_action: Tensor) -> "Seen":
        """With the base's rotation worked out once for all terms."""
        inverse = conjugate(state.root_quat_w)
        return cls(state, ref, last_action, inverse, matrix(inverse))

    @property
    def key_pos_w(self) -> Tensor:
        """Key bodies (B, K, 3) [m] as the encoders put them."""
        read = self.state.read_key_pos_w
        return self.state.key_pos_w if read is None else read


def gravity_b(seen: Seen) -> Tensor:
    """Direction of gravity (B, 3) in the base frame.

    Not in the paper's list, which names proprioception "including" five terms; without it, or an orientation, no policy
    knows which way is up.
    """
    return -seen.to_base[:, :, 2]


def root_lin_vel_b(seen: Seen) -> Tensor:
    """Teacher: "linear velocity" (B, 3) [m/s] of the root in the base frame."""
    return seen.state.root_lin_vel_b


def root_ang_vel_b(seen: Seen) -> Tensor:
    """Teacher and student: "angular velocity" (B, 3) [rad/s] of the root in the base frame."""
    return seen.state.root_ang_vel_b


def joint_pos(seen: Seen) -> Tensor:
    """Teacher and student: "joint position" (B, J) [rad]."""
    return seen.state.joint_pos


def joint_vel(seen: Seen) -> Tensor:
    """Teacher and student: "joint velocity" (B, J) [rad/s]."""
    return seen.state.joint_vel


def last_action(seen: Seen) -> Tensor:
    """Teacher and student: "last action" (B, J), the policy's previous output."""
    return seen.last_action


def root_rotation_g(seen: Seen) -> Tensor:
    """The root's own orientation in the world (B, 6), two columns of its matrix.

    Not in the paper's list; targets in global axes mean nothing to a robot that does not know how it stands in them.
    """
    return seen.to_base.mT[..., :2].flatten(-2)


def target_joint_pos(seen: Seen) -> Tensor:
    """Teacher and student: "target joint positions" (B, J) [rad]."""
    return seen.ref.joint_pos


def target_key_pos_g(seen: Seen) -> Tensor:
    """Teacher: "target keypoint positions" in global coordinates (B, 3 K) [m], from the robot's root."""
    return (seen.ref.key_pos_w - seen.state.root_pos_w[:, None]).flatten(1)


def target_root_pos_g(seen: Seen) -> Tensor:
    """Teacher: "target root translations" in global coordinates (B, 3) [m], from the robot's root."""
    return seen.ref.root_pos_w - seen.state.root_pos_w


def target_root_rotation_g(seen: Seen) -> Tensor:
    """Teacher: "target root rotations" in global coordinates (B, 6), two columns of the matrix."""
    return _six(seen.ref.root_quat_w)


def target_root_pos_b(seen: Seen) -> Tensor:
    """Student: target "root translation" in local coordinates (B, 3) [m]: from the robot's root, in its base frame."""
    return _turned(seen, (seen.ref.root_pos_w - seen.state.root_pos_w)[:, None])


def target_root_rotation_b(seen: Seen) -> Tensor:
    """Student: target "root rotations" in local coordinates (B, 6): from the robot's to the reference's orientation."""
    return _six(multiply(seen.inverse, seen.ref.root_quat_w))


def root_height(seen: Seen) -> Tensor:
    """Height of the root above the ground (B, 1) [m]."""
    return seen.state.root_pos_w[:, 2:]


def key_pos_b(seen: Seen) -> Tensor:
    """The robot's own key bodies (B, 3 K) [m] from its root, in the base frame."""
    return _turned(seen, seen.key_pos_w - seen.state.root_pos_w[:, None])


def key_error_b(seen: Seen) -> Tensor:
    """From the robot's key bodies to the reference's (B, 3 K) [m], in the base frame."""
    return _turned(seen, seen.ref.key_pos_w - seen.key_pos_w)


def target_key_pos_b(seen: Seen) -> Tensor:
    """Target key bodies (B, 3 K) [m] from the robot's root, in its base frame."""
    return _turned(seen, seen.ref.key_pos_w - seen.state.root_pos_w[:, None])


def target_joint_vel(seen: Seen) -> Tensor:
    """Target joint velocities (B, J) [rad/s]."""
    return seen.ref.joint_vel


def target_lin_vel_b(seen: Seen) -> Tensor:
    """Target velocity of the root (B, 3) [m/s] in the robot's base frame."""
    return _turned(seen, seen.ref.root_lin_vel_w[:, None])


def target_ang_vel(seen: Seen) -> Tensor:
    """Target angular velocity of the root (B, 3) [rad/s] in the reference's own base frame."""
    return seen.ref.root_ang_vel_b


def demo(seen: Seen) -> Tensor:
    """Our own observation without history, of many parts: `tracking.observing.observations.observe`."""
    return observe(seen.state, seen.ref, seen.last_action)


def demo_in_place(seen: Seen) -> Tensor:
    """`demo` with the reference moved over the robot: what sees it needs no odometry of its place in the plane."""
    return observe(seen.state, over_robot(seen.ref, seen.state.root_pos_w), seen.last_action)


def imu(seen: Seen) -> Tensor:
    """All that IMU and encoders give, without odometry, of many parts: `tracking.observing.imu.observe_imu`."""
    return observe_imu(seen.state, seen.ref, seen.last_action)


Term = Callable[[Seen], Tensor]
_THREE, _KEYS = 3, 3 * len(KEY_BODIES)
_SIZES: dict[Term, int | None] = {  # None: one entry a joint
    gravity_b: _THREE,
    root_lin_vel_b: _THREE,
    root_ang_vel_b: _THREE,
    joint_pos: None,
    joint_vel: None,
    last_action: None,
    root_rotation_g: 6,
    target_joint_pos: None,
    target_key_pos_g: _KEYS,
    target_root_pos_g: _THREE,
    target_root_rotation_g: 6,
    target_root_pos_b: _THREE,
    target_root_rotation_b: 6,
    root_height: 1,
    key_pos_b: _KEYS,
    key_error_b: _KEYS,
    target_key_pos_b: _KEYS,
    target_joint_vel: None,
    target_lin_vel_b: _THREE,
    target_ang_vel: _THREE,
}
LAYOUTS = {demo.__name__: layout, demo_in_place.__name__: layout, imu.__name__: imu_layout}
"""Parts of the terms that have many, by joints and further reference frames."""
TERMS: dict[str, Term] = {term.__name__: term for term in (*_SIZES, demo, demo_in_place, imu)}
"""Every term by its name."""

SETS: dict[str, tuple[str, ...]] = {
    "teacher": (
        "gravity_b",
        "root_lin_vel_b",
        "root_ang_vel_b",
        "joint_pos",
        "joint_vel",
        "last_action",
        "root_rotation_g",
        "target_joint_pos",
        "target_key_pos_g",
        "target_root_pos_g",
        "target_root_rotation_g",
    ),
    "student": (
        "gravity_b",
        "root_ang_vel_b",
        "joint_pos",
        "joint_vel",
        "last_action",
        "target_joint_pos",
        "target_root_pos_b",
        "target_root_rotation_b",
    ),
}
"""Terms that go by one name: the paper's teacher and student."""


def add_terms(sizes: Mapping[Term, int | None], noise: Mapping[str, float] | None = None) -> None:
    """Make further terms known by their names, with the largest error of those that carry any.

    Args:
        sizes: entries of each term; None: one a joint.
        noise: see `tracking.observing.noise.LEVELS`.
    """
    _SIZES.update(sizes)
    TERMS.update({term.__name__: term for term in sizes})
    LEVELS.update(noise or {})


def expanded(terms: Sequence[str]) -> tuple[str, ...]:
    """The terms with the names of sets replaced by their terms.

    Raises:
        BadInput: for a name that is neither.
    """
    names = [name for given in terms for name in SETS.get(given, (given,))]
    if unknown := [name for name in names if name not in TERMS]:
        near = difflib.get_close_matches(unknown[0], [*SETS, *TERMS], n=3)
        hint = f"Did you mean {' or '.join(near)}?" if near else f"The sets of terms are {', '.join(SETS)}."
        raise BadInput("observation.terms", "names of sets or terms", repr(unknown[0])[:80], hint)
    return tuple(names)


def parts(terms: Sequence[str], joints: int = len(joint_names()), ahead: int = 0) -> list[Part]:
    """Names and sizes of the parts of one control step, in order; `ahead` counts further reference frames."""
    out: list[Part] = []
    for name in expanded(terms):
        if name in LAYOUTS:
            out += LAYOUTS[name](joints, ahead)
        else:
            size = _SIZES[TERMS[name]]
            out.append((name, joints if size is None else size))
    return out


def see(terms: Sequence[str], state: RobotState, ref: ReferenceFrame, action: Tensor) -> Tensor:
    """One control step of an observation (B, D), exact; `terms` are expanded, `action` (B, J) is the previous one."""
    if tuple(terms) == ("demo",):
        return observe(state, ref, action)
    seen = Seen.of(state, ref, action)
    return torch.cat([TERMS[name](seen) for name in terms], dim=-1)


def _turned(seen: Seen, vectors_w: Tensor) -> Tensor:
    """Vectors (B, N, 3) of the world in the base frame, (B, 3 N)."""
    return turned(vectors_w, seen.to_base).flatten(1)


def _six(quat: Tensor) -> Tensor:
    """First two columns of the rotation matrix, (B, 6)."""
    return matrix(quat)[..., :2].flatten(-2)
