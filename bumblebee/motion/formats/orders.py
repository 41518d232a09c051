"""Orders of the G1's joints and bodies in files of other programs, and which one a file has.

MuJoCo goes through the tree depth-first (one limb after the other: Unitree's order), Isaac breadth-first (all hips,
then what hangs on them). A file of arrays says neither, so forward kinematics decides: with the right order of joints
it puts the bodies where the file has them, with a wrong one it does not.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.formats.layouts import arranged
from bumblebee.motion.kinematics import forward_bodies
from bumblebee.motion.reading.remedy import say
from bumblebee.robot.facts import HELD_JOINTS, KEY_BODIES, PELVIS, path_to, robot_bodies

NEAR = 0.03  # m: mean distance of a file's bodies from ours; other editions of the G1's model differ by millimetres
_APART = 2.0  # so many times worse must the next best order be
_FLOOR = 0.002  # m: below this, distances are rounding
_FRAMES = 16  # that are compared
DEPTH, BREADTH = "depth_first", "breadth_first"


@dataclass(frozen=True)
class Order:
    """How a file's arrays are laid out."""

    joints: str
    """`DEPTH` or `BREADTH`, with 23 joints and their layout; "" if the file names its joints."""
    bodies: str
    root: int
    """Place of the pelvis among the bodies."""
    quaternion: str
    """wxyz or xyzw."""
    error: float
    """Mean distance of the bodies from where forward kinematics puts them [m]."""
    names: tuple[str, ...]
    """The joints in the order of their columns."""


@cache
def breadth_first() -> tuple[str, ...]:
    """Names of the 30 bodies as Isaac orders them, the pelvis first."""
    below: dict[str, list[str]] = {}
    for name, facts in robot_bodies().items():
        below.setdefault(facts["parent"], []).append(name)
    found, level = [], below["world"]
    while level:
        found += level
        level = [child for name in level for child in below.get(name, [])]
    return tuple(found)


@cache
def joint_order(kind: str, layout: tuple[str, ...]) -> tuple[str, ...]:
    """The joints of a layout depth-first or breadth-first."""
    bodies = breadth_first() if kind == BREADTH else tuple(robot_bodies())
    names = (robot_bodies()[body]["joint"]["name"] for body in bodies if "joint" in robot_bodies()[body])
    return tuple(name for name in names if name in layout)


def body_orders(count: int) -> dict[str, tuple[str, ...]]:
    """Known lists of so many bodies; MuJoCo's may begin with the world."""
    depth = tuple(robot_bodies())
    known = {
        "depth-first": depth,
        "breadth-first": breadth_first(),
        "depth-first with the world": ("world", *depth),
        "key bodies": KEY_BODIES,
    }
    return {kind: names for kind, names in known.items() if len(names) == count}


def detect(
    where: object,
    joints: np.ndarray,
    body_pos: np.ndarray,
    body_quat: np.ndarray,
    named: dict[str, tuple[str, ...]],
) -> Order:
    """The order in which joints and bodies agree.

    Args:
        where: the file.
        joints: (T, J) [rad].
        body_pos: (T, B, 3) [m, world].
        body_quat: (T, B, 4), of either order.
        named: the orders of joints that come into question.

    Raises:
        BadInput: none agrees, or several do.
    """
    some = np.unique(np.linspace(0, len(joints) - 1, _FRAMES).round().astype(int))
    with np.errstate(all="ignore"):
        found = sorted(_candidates(joints[some], body_pos[some], body_quat[some], named), key=lambda o: o.error)
    known = f"G1 bodies in a known order ({len(robot_bodies())} depth-first or breadth-first, or the 14 tracked ones)"
    if not found:
        raise BadInput(f"{where}, body_pos_w", known, f"{body_pos.shape[1]} bodies")
    best = found[0]
    if best.error > NEAR:
        beside = f"joints that put them {best.error:.2f} m beside in the mean, in the best order of all that are known"
        came = beside if np.isfinite(best.error) else "no finite numbers"
        raise BadInput(f"{where}, body_pos_w", known, came, "A motion of another robot?")
    limit = max(_APART * best.error, _FLOOR)
    rival = next((o for o in found if o.error <= limit and not _alike(joints[some], o, best)), None)
    if rival:
        came = f"two that fit ({best.joints}, {rival.joints}; {best.quaternion}, {rival.quaternion})"
        raise BadInput(f"{where}, joint_pos", "one order of the joints", came, demand(named))
    return best


def demand(named: dict[str, tuple[str, ...]]) -> str:
    """How to say which of several orders of joints a file has: `DEPTH` is MuJoCo's and mjlab's, `BREADTH` Isaac's."""
    return say(*({key: word for key, word in zip(KEYS, kind.split(), strict=False)} for kind in named))


KEYS = ("npz_joints", "joints_23")
"""The settings of which the name of an order of joints consists."""


def _alike(joints: np.ndarray, one: Order, other: Order) -> bool:
    """Whether it makes no difference which of two orders is taken."""
    same = np.allclose(arranged(joints, one.names), arranged(joints, other.names))
    return one.quaternion == other.quaternion and same


def _candidates(
    joints: np.ndarray, body_pos: np.ndarray, body_quat: np.ndarray, named: dict[str, tuple[str, ...]]
) -> Iterator[Order]:
    for kind, names in named.items():
        angles = arranged(joints, names)
        for bodies, order in body_orders(body_pos.shape[1]).items():
            root = order.index(PELVIS)
            for quaternion in ("wxyz", "xyzw"):
                quat = body_quat[:, root][:, [quaternion.index(part) for part in "wxyz"]]
                error = _distance(body_pos, order, forward_bodies(body_pos[:, root], quat, angles))
                yield Order(kind, bodies, root, quaternion, error, names)


@cache
def _beyond_held(body: str) -> bool:
    """Whether a joint that is held still here, and may turn in the file, moves the body's place."""
    above = (robot_bodies()[name].get("joint", {}).get("name") for name in path_to(body)[:-1])
    return any(joint in HELD_JOINTS for joint in above)


def _distance(body_pos: np.ndarray, order: tuple[str, ...], poses: dict) -> float:
    """Mean distance of the bodies over the frames without NaN [m]; those beyond held joints do not count."""
    distances = np.stack(
        [
            np.linalg.norm(body_pos[:, column] - poses[name][0], axis=1)
            for column, name in enumerate(order)
            if name != "world" and not _beyond_held(name)
        ]
    )
    whole = np.isfinite(distances).all(axis=0)
    return float(distances[:, whole].mean()) if whole.any() else np.inf
