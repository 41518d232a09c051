"""Limbs of a skeleton: pairs of chains that mirror each other in the lengths of their bones, and the joints in them.

Nothing here needs a pose: the pose of a file whose angles are all zero may be any. Joints in one place, and those that
only twist a bone, count as one node.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bumblebee.motion.human.words import is_twist, side_of, weight

LEG = ("hip", "knee", "ankle", "toe")
ARM = ("shoulder", "elbow", "wrist")
_PAIRS = 6  # of chains that are tried as legs and as arms, the longest ones

_Score = tuple[int, float, int]
"""Score: agreement of names, length of the two long bones, and steps without a node between."""
_Chain = tuple[Any, "Placed"] | None
"""The role placed last, behind those before it."""
_Labelled = tuple[_Score, _Chain]
_NONE: _Labelled = ((0, 0.0, 0), None)


@dataclass(frozen=True, eq=False)
class Nodes:
    """Places of a skeleton, parents before children."""

    joints: list[list[int]]
    """Joints in each place, the topmost first."""
    parents: list[int]
    children: list[list[int]]
    bones: np.ndarray
    """Length of the bone from each node's parent, (N,); the root's is 0."""

    def ancestors(self, node: int) -> list[int]:
        """The node itself and all nodes above it."""
        found = []
        while node >= 0:
            found.append(node)
            node = self.parents[node]
        return found


@dataclass(frozen=True)
class Placed:
    """A role of both limbs of a pair: the joints, and the weight of their names."""

    role: str
    joints: tuple[int, int]
    weight: int


@dataclass(frozen=True)
class Limbs:
    """A pair of chains labelled as legs or as arms; `roles` lacks those for which the chains are too short."""

    pair: tuple[int, int]
    """The nodes in which the chains begin, children of one node."""
    score: _Score
    roles: tuple[Placed, ...]
    side: int
    """Above 0: the names say that the first is the left one; below 0: the second; 0: they do not say it."""


def nodes_of(names: Sequence[str], parents: Sequence[int], offsets: np.ndarray) -> Nodes:
    """The places of joints with plain names, from the offsets (J, 3) to their parents."""
    length = np.linalg.norm(offsets, axis=1)
    nodes = Nodes([], [], [], np.zeros(0))
    of: list[int] = []  # the node of each joint
    carried: list[float] = []  # length from the node to the joint
    there: list[bool] = []  # whether the joint lies in the node
    bones: list[float] = []
    for joint, parent in enumerate(parents):
        twist = parent >= 0 and is_twist(names[joint])
        if parent >= 0 and (twist or length[joint] == 0):
            of.append(of[parent])
            carried.append(carried[parent] + float(length[joint]))
            there.append(there[parent] and not twist)
            if there[joint]:
                nodes.joints[of[joint]].append(joint)
            continue
        of.append(len(nodes.joints))
        bones.append(carried[parent] + float(length[joint]) if parent >= 0 else 0.0)
        carried.append(0.0)
        there.append(True)
        nodes.joints.append([joint])
        nodes.parents.append(of[parent] if parent >= 0 else -1)
        nodes.children.append([])
        if parent >= 0:
            nodes.children[of[parent]].append(of[joint])
    return Nodes(nodes.joints, nodes.parents, nodes.children, np.array(bones))


def mirrored(nodes: Nodes) -> np.ndarray:
    """How long the chains are that two nodes begin alike, (N, N).

    Two bones count as far as they are as long as each other: the shorter one's length less the difference. Of the
    nodes' children the two that go on best are added, where they go on alike at all.
    """
    bones, parents = nodes.bones, np.array(nodes.parents)
    alike = np.minimum.outer(bones, bones) - np.abs(np.subtract.outer(bones, bones))
    below = np.zeros_like(alike)
    for node in range(len(bones) - 1, 0, -1):
        alike[node] += below[node]
        best = np.zeros(len(bones))
        np.maximum.at(best, parents[1:], alike[node, 1:])
        np.maximum(below[parents[node]], best, out=below[parents[node]])
    return alike


def pairs(nodes: Nodes, alike: np.ndarray) -> list[tuple[int, int]]:
    """The longest pairs of chains that begin at one node."""
    parents = np.array(nodes.parents)
    one, other = np.nonzero(np.triu(parents[:, None] == parents[None, :], 1) & (alike > 0))
    best = np.argsort(-alike[one, other], kind="stable")[:_PAIRS]
    return [(int(one[i]), int(other[i])) for i in best]


def labelled(
    names: Sequence[str], nodes: Nodes, alike: np.ndarray, pair: tuple[int, int], roles: Sequence[str]
) -> Limbs:
    """The joints of a pair of chains that play `roles`, in their order from the body outwards.

    What the names say counts most, then the length of the bones into the second and third role (thigh and shank, upper
    arm and forearm) where nothing lies between, then that nothing lies between the others.
    """
    best = _NONE
    nothing: list[_Labelled | None] = [None] * len(roles)
    stack = [(pair, nothing, nothing)]
    while stack:
        (one, other), direct, above = stack.pop()
        bone = float(nodes.bones[one] + nodes.bones[other])
        here: list[_Labelled | None] = []
        for number, role in enumerate(roles):
            came = above[number - 1] if number else _NONE
            if number and (before := direct[number - 1]):
                (said, long, steps), chain = before
                came = _best(came, ((said, long + bone * (number in (1, 2)), steps + 1), chain))
            here.append(None)
            if came:
                placed = _placed(names, nodes.joints[one], nodes.joints[other], role)
                (said, long, steps), chain = came
                here[number] = ((said + max(placed.weight, 0), long, steps), (chain, placed))
                best = _best(best, here[number]) or best
        higher = [_best(a, b) for a, b in zip(above, direct, strict=True)]
        stack += [(partners, here, higher) for partners in _partners(names, nodes, alike, one, other)]
    found, chain = [], best[1]
    while chain:
        found.append(chain[1])
        chain = chain[0]
    sides = [side_of(*(names[joint] for joint in placed.joints)) for placed in found]
    return Limbs(pair, best[0], tuple(reversed(found)), sum(sides))


def _best(one: _Labelled | None, other: _Labelled | None) -> _Labelled | None:
    """The one with the higher score; the first where they are equal or there is no other."""
    return other if one is None or (other is not None and other[0] > one[0]) else one


def _partners(names: Sequence[str], nodes: Nodes, alike: np.ndarray, one: int, other: int) -> list[tuple[int, int]]:
    """Each child of a node with that of its mirror image that is named like it, or else goes on most like it."""

    def likeness(a: int, b: int) -> tuple[bool, float]:
        sided = side_of(names[nodes.joints[a][0]], names[nodes.joints[b][0]])
        return bool(sided), float(alike[a, b])

    others = nodes.children[other]
    return [(a, max(others, key=lambda b: likeness(a, b))) for a in nodes.children[one] if others]


def _placed(names: Sequence[str], ones: list[int], others: list[int], role: str) -> Placed:
    """The joints of two places whose names speak most for a role; the topmost where none does more than another."""
    found = [(weight(role, names[a]), (a, b)) for a, b in zip(ones, others, strict=False)]
    said, joints = max(found, key=lambda one: one[0])
    return Placed(role, joints, said)
