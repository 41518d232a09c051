"""The tree of a robot's joints as chains from the base to its ends, padded to one length."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True)
class Chains:
    """C chains of L joints each; a joint that several chains share stands in each, padding stays where it is.

    A place is the number of a link among (L + 1) * C, the base first: 0 to C - 1 is the base, then the chains' first
    links. Fixed bodies are counted to the link that carries them.
    """

    column: np.ndarray
    """(L, C) column of the joint angles; J, where there is none, for padding."""
    offset: np.ndarray
    """(L, C, 3) [m] in the frame of the link before."""
    turn: np.ndarray
    """(L, C, 4) orientation in the frame of the link before at angle 0, wxyz."""
    axis: np.ndarray
    """(L, C, 3) of the hinge in the link's frame; 0 for padding."""
    carrier: np.ndarray
    """(K,) place of the link that carries each wanted body."""
    reach: np.ndarray
    """(K, 3) [m] the body in the frame of that link."""
    fixed: np.ndarray
    """(K, 4) its orientation there, wxyz."""
    place_of: np.ndarray
    """(J,) a place of each joint's link; of a joint that carries no wanted body the base's."""
    joint_axis: np.ndarray
    """(J, 3) axis of each joint in its link's frame."""
    carries: np.ndarray
    """(J + 1, K) 1 where a joint carries a body; the last row is the base, which carries all."""


def chains_of(model: mujoco.MjModel, wanted: Sequence[int]) -> Chains:
    """The chains to some bodies (ids) of a model with a free base and at most one hinge a body."""
    base, joints = int(model.jnt_bodyid[0]), model.njnt - 1
    found = [_carried(model, body, base) for body in wanted]
    links = {link for carrier, _, _ in found for link in _up(model, carrier, base)}
    ends = links - {link for start in links for link in list(_up(model, start, base))[1:]}
    paths = [list(_up(model, end, base))[::-1] for end in sorted(ends)]
    length, count = max(map(len, paths), default=0), max(len(paths), 1)
    column = np.full((length, count), joints)
    offset, axis = np.zeros((length, count, 3)), np.zeros((length, count, 3))
    turn = np.tile([1.0, 0, 0, 0], (length, count, 1))
    place = {base: 0}
    for chain, path in enumerate(paths):
        for level, link in enumerate(path):
            joint = int(model.body_jntadr[link])
            column[level, chain], axis[level, chain] = joint - 1, model.jnt_axis[joint]
            _, offset[level, chain], turn[level, chain] = _carried(model, int(model.body_parentid[link]), base, link)
            place[link] = (level + 1) * count + chain
    carries = np.ones((joints + 1, len(wanted)))
    for body, (carrier, _, _) in enumerate(found):
        above = {int(model.body_jntadr[link]) - 1 for link in _up(model, carrier, base)}
        carries[:-1, body] = [joint in above for joint in range(joints)]
    return Chains(
        column=column,
        offset=offset,
        turn=turn,
        axis=axis,
        carrier=np.array([place[carrier] for carrier, _, _ in found]),
        reach=np.array([offset for _, offset, _ in found]),
        fixed=np.array([turn for _, _, turn in found]),
        place_of=np.array([place.get(int(model.jnt_bodyid[joint]), 0) for joint in range(1, joints + 1)], dtype=int),
        joint_axis=model.jnt_axis[1:],
        carries=carries,
    )


def _up(model: mujoco.MjModel, body: int, base: int) -> Iterator[int]:
    """A body and those above it that have a hinge, up to the base, which is not among them."""
    while body not in (base, 0):
        if model.body_jntnum[body]:
            yield body
        body = int(model.body_parentid[body])


def _carried(model: mujoco.MjModel, body: int, base: int, end: int | None = None) -> tuple[int, np.ndarray, np.ndarray]:
    """The link that carries a body, and position (3,) and orientation (4,) of the body in its frame.

    With `end`, a child of the body, these are of the child at angle 0.
    """
    chain = [] if end is None else [end]
    while body not in (base, 0) and not model.body_jntnum[body]:
        chain.append(body)
        body = int(model.body_parentid[body])
    place, turn = np.zeros(3), np.array([1.0, 0, 0, 0])
    for inner in reversed(chain):
        shift, whole = np.empty(3), np.empty(4)
        mujoco.mju_rotVecQuat(shift, model.body_pos[inner], turn)
        mujoco.mju_mulQuat(whole, turn, model.body_quat[inner])
        place, turn = place + shift, whole
    return body, place, turn
