"""Which joint of a skeleton plays which role, from its tree and the lengths of its bones, with names as evidence.

Legs and arms are two pairs of chains that mirror each other and begin at different joints; of these the longer pair is
the legs where names say nothing. What leads from the arms' joint to the head is the neck, what comes before it the
chest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations

import numpy as np

from bumblebee.motion.human.limbs import ARM, LEG, Limbs, Nodes, labelled, mirrored, nodes_of, pairs
from bumblebee.motion.human.motion import LANDMARKS
from bumblebee.motion.human.words import AGAINST, SURE, WEAK, plain, weight

NAME, PLACE, OTHERWISE = "by name", "by place and length", "by place and length, against its name"
EVIDENCE = (NAME, PLACE, OTHERWISE)
"""Kinds of evidence for a role."""
_BY = {SURE: NAME, WEAK: NAME, 0: PLACE, AGAINST: OTHERWISE}


@dataclass(frozen=True)
class Roles:
    """The joint of each landmark that has one, and why."""

    joints: dict[str, int]
    evidence: dict[str, str]
    sided: dict[str, bool]
    """Whether the names say which leg (`hip`) and which arm (`shoulder`) is the left one."""


def find_roles(names: Sequence[str], parents: Sequence[int], offsets: np.ndarray) -> Roles:
    """The roles of a skeleton's joints.

    Args:
        names: of the joints; the end of a chain as `<joint>/end`.
        parents: index of each joint's parent, smaller than its own; -1 for the root.
        offsets: of each joint from its parent, (J, 3), in any unit.
    """
    return _find(tuple(names), tuple(parents), np.ascontiguousarray(offsets, dtype=np.float64).tobytes())


@lru_cache(maxsize=256)
def _find(names: tuple[str, ...], parents: tuple[int, ...], offsets: bytes) -> Roles:
    """The files of one recording share a skeleton, which is looked at once."""
    words = [plain(name) for name in names]
    nodes = nodes_of(words, parents, np.frombuffer(offsets).reshape(-1, 3))
    alike = mirrored(nodes)
    found = pairs(nodes, alike)
    legs = [labelled(words, nodes, alike, pair, LEG) for pair in found]
    arms = [labelled(words, nodes, alike, pair, ARM) for pair in found]
    both = [(legs[a], arms[b]) for a, b in permutations(range(len(found)), 2) if _apart(nodes, found[a], found[b])]
    if not both:
        return Roles({}, {}, {})
    leg, arm = max(both, key=_quality)
    placed = {
        f"{side}_{one.role}": (one.joints[number], one.weight)
        for limbs in (leg, arm)
        for one in limbs.roles
        for number, side in enumerate(("left", "right") if limbs.side >= 0 else ("right", "left"))
    }
    trunk = _trunk(words, nodes, leg, arm).items()
    placed |= {role: (joint, max(weight(role, words[joint]), 0)) for role, joint in trunk}
    ordered = {role: placed[role] for role in LANDMARKS if role in placed}
    evidence = {role: _BY[said] for role, (_, said) in ordered.items()}
    sided = {"hip": leg.side != 0, "shoulder": arm.side != 0}
    return Roles({role: joint for role, (joint, _) in ordered.items()}, evidence, sided)


def _apart(nodes: Nodes, one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether two pairs begin at different joints, neither of them within a chain of the other pair."""
    at = [nodes.parents[one[0]], nodes.parents[other[0]]]
    within = set(nodes.ancestors(at[0])) & set(other) | set(nodes.ancestors(at[1])) & set(one)
    return at[0] != at[1] and not within


def _quality(both: tuple[Limbs, Limbs]) -> tuple[int, float, float]:
    """How much speaks for a pair of legs and a pair of arms: names, then long bones, then legs longer than arms."""
    leg, arm = both
    return leg.score[0] + arm.score[0], leg.score[1] + arm.score[1], leg.score[1]


def _trunk(words: Sequence[str], nodes: Nodes, leg: Limbs, arm: Limbs) -> dict[str, int]:
    """Pelvis, chest, neck and head, as far as there are such joints."""
    hips, shoulders = nodes.parents[leg.pair[0]], nodes.parents[arm.pair[0]]
    above, below = nodes.ancestors(hips), nodes.ancestors(shoulders)
    meet = next(node for node in above if node in set(below))
    spine = [*above[: above.index(meet) + 1], *reversed(below[: below.index(meet)])]
    named = [node for node in above if _best(words, nodes, node, "pelvis")[1] > 0]
    found = {"pelvis": _best(words, nodes, (named or [hips])[0], "pelvis")[0]}
    inside = nodes.joints[shoulders]
    hung = weight("neck", words[inside[0]]) > 0  # 3ds Max hangs the arms from the neck
    chest = spine[-2] if hung else shoulders
    if chest != hips:
        found["chest"] = _best(words, nodes, chest, "chest")[0]
    chain = _to_head(words, nodes, shoulders, {*arm.pair, *spine})
    if chain and _best(words, nodes, chain[-1], "neck")[1] <= 0:
        found["head"] = _best(words, nodes, chain.pop(), "head")[0]
    before = [joint for node in chain for joint in nodes.joints[node]]
    by_name = [joint for joint in (*inside[:hung], *before) if weight("neck", words[joint]) > 0]
    behind = [joint for joint in inside if weight("neck", words[joint]) > 0]
    if necks := [*by_name, *before, *behind]:
        found["neck"] = necks[0]
    return found


def _to_head(words: Sequence[str], nodes: Nodes, start: int, leave: set[int]) -> list[int]:
    """The nodes from behind `start` to the head: the first of that name, else the last joint of the longest chain."""
    chains: list[tuple[float, list[int]]] = []
    stack = [(0.0, [child]) for child in reversed(nodes.children[start]) if child not in leave]
    while stack:
        long, chain = stack.pop()
        long += float(nodes.bones[chain[-1]])
        if words[nodes.joints[chain[-1]][0]]:  # no end
            chains.append((long, chain))
        stack += [(long, [*chain, child]) for child in reversed(nodes.children[chain[-1]])]
    named = [chain for _, chain in chains if _best(words, nodes, chain[-1], "head")[1] > 0]
    longest = max(chains, key=lambda one: one[0], default=(0.0, []))[1]
    return min(named, key=len, default=longest)


def _best(words: Sequence[str], nodes: Nodes, node: int, role: str) -> tuple[int, int]:
    """The joint of a place whose name speaks most for a role, and how much."""
    joint = max(nodes.joints[node], key=lambda joint: weight(role, words[joint]))
    return joint, weight(role, words[joint])
