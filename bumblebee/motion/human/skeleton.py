"""The joints of a BVH file that stand for the landmarks: as a mapping file says, or recognised; refused where open."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.human.bvh import Bvh
from bumblebee.motion.human.forward import bone_offsets, bvh_positions
from bumblebee.motion.human.frame import knees_ahead, toes_ahead
from bumblebee.motion.human.motion import LANDMARKS, Role
from bumblebee.motion.human.roles import NAME, OTHERWISE, PLACE, find_roles
from bumblebee.motion.human.skeleton_file import Stated, joints_stated

DO = "Say which joint is which: --skeleton FILE (motions.read.skeleton); `bumblebee motions inspect` prints the file."
_FEW = 6  # landmarks or joints in a line
_LEGS = [i for i, name in enumerate(LANDMARKS) if name.endswith(("hip", "knee", "ankle", "toe"))]
_ARMS = [i for i, name in enumerate(LANDMARKS) if name.endswith(("shoulder", "elbow", "wrist"))]


class UnknownSkeleton(BadInput):
    """A skeleton whose roles must be stated; `roles` has those that were found."""

    roles: tuple[Role, ...] = ()

    def found(self, roles: Sequence[Role]) -> "UnknownSkeleton":
        """The error with the roles that were found."""
        self.roles = tuple(roles)
        return self


@dataclass(frozen=True, eq=False)
class Skeleton:
    """`joints` (18,) of `LANDMARKS`, `places` (T, 18, 3) in the file's unit and axes, and who says so."""

    joints: tuple[int, ...]
    places: np.ndarray
    roles: tuple[Role, ...]
    note: str


def find_skeleton(where: object, bvh: Bvh, stated: Stated | None = None) -> Skeleton:
    """The landmarks of a file.

    Args:
        where: the file.
        bvh: its content.
        stated: a mapping file's content; None to recognise the skeleton.

    Raises:
        BadInput: the mapping names joints that are not there.
        UnknownSkeleton: a landmark has no joint, or only one whose name says otherwise.
    """
    found = _stated(where, bvh, stated) if stated is not None else _recognised(where, bvh)
    if toes_ahead(found.places) < 0:
        wanted = "right-handed axes, and left joints on the left"
        came = "toes that point backwards: left and right exchanged, or left-handed axes"
        raise UnknownSkeleton(where, wanted, came, f"{DO} Left-handed axes: export it again.").found(found.roles)
    return found


def _stated(where: object, bvh: Bvh, stated: Stated) -> Skeleton:
    joints, by = joints_stated(where, stated, bvh.names), f"as {stated.where} says"
    return Skeleton(joints, bvh_positions(bvh, joints), _rows(joints, bvh, dict.fromkeys(LANDMARKS, by)), by)


def _recognised(where: object, bvh: Bvh) -> Skeleton:
    found = find_roles(bvh.names, bvh.parents, bone_offsets(bvh))
    named = {name: bvh.names[joint] for name, joint in found.joints.items()}
    _require(where, bvh, [Role(name, named.get(name, ""), found.evidence.get(name, "")) for name in LANDMARKS])
    joints = [found.joints[name] for name in LANDMARKS]
    places = bvh_positions(bvh, joints)
    order = _left_first(places, found.sided["hip"], found.sided["shoulder"])
    evidence = {name: found.evidence[LANDMARKS[i]] for name, i in zip(LANDMARKS, order, strict=True)}
    roles = _rows([joints[i] for i in order], bvh, evidence)
    if not any(found.sided.values()) and knees_ahead(places[:, order]) <= 0:
        wanted = "names with sides, or toes that point to where the knees bend: they tell left from right"
        raise UnknownSkeleton(where, wanted, "neither", DO).found(roles)
    guessed = [f"{role.landmark} {role.joint}" for role in roles if role.evidence != NAME]
    note = f"by name but for {_few(guessed)} ({PLACE})" if guessed else "by name"
    note += "" if all(found.sided.values()) else "; left and right by knees and toes"
    return Skeleton(tuple(joints[i] for i in order), places[:, order], roles, note)


def _rows(joints: Sequence[int], bvh: Bvh, evidence: dict[str, str]) -> tuple[Role, ...]:
    return tuple(Role(name, bvh.names[joint], evidence[name]) for name, joint in zip(LANDMARKS, joints, strict=True))


def _require(where: object, bvh: Bvh, roles: Sequence[Role]) -> None:
    """Refuse a skeleton without a joint for each landmark, or with one whose name contradicts its role."""
    missing = [role.landmark for role in roles if not role.joint]
    against = [f"{role.joint} as {role.landmark}" for role in roles if role.evidence == OTHERWISE]
    if not missing and not against:
        return
    wanted = f"a joint for each of the {len(LANDMARKS)} landmarks of a person"
    some = f"its joints begin {', '.join(bvh.names[:_FEW])}"
    if len(missing) == len(LANDMARKS):
        came = f"a skeleton without legs and arms in mirrored pairs ({some})"
    elif missing:
        came = f"a skeleton with none for {_few(missing)} ({some})"
    else:
        came = f"names against the shape: {_few(against)}"
    raise UnknownSkeleton(where, wanted, came[:400], DO).found(roles)


def _few(words: Sequence[str]) -> str:
    return ", ".join(words[:_FEW]) + (" ..." if len(words) > _FEW else "")


def _left_first(places: np.ndarray, legs: bool, arms: bool) -> list[int]:
    """The order of the landmarks (18,) in which left ones are on the left, where names do not say which are.

    Args:
        places: the landmarks, (T, 18, 3), with left and right limbs in any order.
        legs: whether the names say which leg is the left one.
        arms: likewise for the arms.
    """
    order = np.arange(len(LANDMARKS))
    if not legs and not arms and toes_ahead(places) < 0:
        order[_LEGS] = _LEGS[len(_LEGS) // 2 :] + _LEGS[: len(_LEGS) // 2]
    if legs and arms:
        return order.tolist()
    at = {name: places[:, order[i]] for i, name in enumerate(LANDMARKS)}
    hips, shoulders = (at[f"left_{joint}"] - at[f"right_{joint}"] for joint in ("hip", "shoulder"))
    if np.median(np.einsum("ti,ti->t", hips, shoulders)) < 0:
        other = _LEGS if arms else _ARMS
        order[other] = np.concatenate([order[other[len(other) // 2 :]], order[other[: len(other) // 2]]])
    return order.tolist()
