"""Which joint of which skeleton is which landmark: tables of the names that the field uses.

Names are compared without case, signs and the prefix that a program puts before all of them (`mixamorig:Hips`,
`Character1_Hips`, `Bip01 Pelvis`). One table must have a joint for every landmark: names mean different joints in
different tables (`LeftShoulder` is the collar bone's joint for MotionBuilder, the upper arm's in others).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.human.motion import LANDMARKS

_SIDES = ("left", "right")
_LIMBS = ("hip", "knee", "ankle", "toe", "shoulder", "elbow", "wrist")
_PREFIXES = 12  # that are tried: a file of a thousand hips must not take minutes
_TRUNK = ("pelvis", "chest", "neck", "head")


@dataclass(frozen=True)
class Table:
    """Names of one family of skeletons; of several for one landmark, the first that there is is taken.

    In `limbs`, `{}` stands for the side, `left` or `right` as `sides` write it.
    """

    name: str
    sides: tuple[str, str]
    trunk: dict[str, tuple[str, ...]]
    limbs: dict[str, tuple[str, ...]]

    def names(self) -> dict[str, tuple[str, ...]]:
        """The names for each landmark."""
        found = dict(self.trunk)
        for side, word in zip(_SIDES, self.sides, strict=True):
            found |= {f"{side}_{limb}": tuple(n.format(word) for n in self.limbs[limb]) for limb in _LIMBS}
        return found


def _table(name: str, sides: str, trunk: Sequence[str], limbs: Sequence[str]) -> Table:
    """Names as words: `|` between alternatives."""
    left, right = sides.split("|")
    return Table(
        name,
        (left, right),
        {key: tuple(words.split("|")) for key, words in zip(_TRUNK, trunk, strict=True)},
        {key: tuple(words.split("|")) for key, words in zip(_LIMBS, limbs, strict=True)},
    )


_SPINES = "spine4|spine3|spine2|spine1|spine"
TABLES = (
    _table(
        "MotionBuilder, Mixamo, LAFAN1, CMU by cgspeed (31 joints)",
        "left|right",
        ("hips|hip|pelvis", _SPINES, "neck|neck1", "head"),
        ("{}upleg", "{}leg", "{}foot", "{}toebase|{}toe|{}foot/end", "{}arm", "{}forearm", "{}hand"),
    ),
    _table(
        "Poser and DAZ, CMU by cgspeed (43 joints)",
        "l|r",
        ("hip", "chestupper|chest", "neck|necklower", "head"),
        ("{}thigh|{}thighbend", "{}shin", "{}foot", "{}toe|{}foot/end", "{}shldr|{}shldrbend", "{}forearm", "{}hand"),
    ),
    _table(
        "3ds Max, CMU by cgspeed with joints' names (31 joints)",
        "left|right",
        ("hips|hip|pelvis", "chest4|chest3|chest2|chest", "neck|neck1", "head"),
        (
            "{}hip",
            "{}knee",
            "{}ankle",
            "{}toe|{}toebase|{}ankle/end",
            "{}shoulder",
            "{}elbow",
            "{}wrist",
        ),
    ),
    _table(
        "SMPL",
        "left|right",
        ("pelvis", "spine3", "neck", "head"),
        ("{}hip", "{}knee", "{}ankle", "{}foot", "{}shoulder", "{}elbow", "{}wrist"),
    ),
    _table(
        "SMPL, sides as letters",
        "l|r",
        ("pelvis", "spine3|chest", "neck", "head"),
        ("{}hip", "{}knee", "{}ankle", "{}foot|{}toe", "{}shoulder", "{}elbow", "{}wrist"),
    ),
    _table(
        "3ds Max Biped",
        "l|r",
        ("pelvis", _SPINES, "neck", "head"),
        ("{}thigh", "{}calf", "{}foot", "{}toe0|{}toe|{}foot/end", "{}upperarm", "{}forearm", "{}hand"),
    ),
    _table(
        "Biovision",
        "left|right",
        ("hips|hip", "chest2|chest", "neck", "head"),
        ("{}upleg", "{}lowleg", "{}foot", "{}toe|{}foot/end", "{}uparm", "{}lowarm", "{}hand"),
    ),
    _table(
        "Unity, VRM",
        "left|right",
        ("hips", "upperchest|chest|spine", "neck", "head"),
        ("{}upperleg", "{}lowerleg", "{}foot", "{}toes|{}foot/end", "{}upperarm", "{}lowerarm", "{}hand"),
    ),
    _table(
        "OptiTrack",
        "l|r",
        ("hip", "chest", "neck", "head"),
        ("{}thigh", "{}shin", "{}foot", "{}toe|{}foot/end", "{}uarm", "{}farm", "{}hand"),
    ),
    _table(
        "Unreal",
        "l|r",
        ("pelvis", "spine05|spine04|spine03|spine02", "neck01|neck", "head"),
        ("thigh{}", "calf{}", "foot{}", "ball{}|foot{}/end", "upperarm{}", "lowerarm{}", "hand{}"),
    ),
)


def find_landmarks(where: object, names: Sequence[str], offsets: np.ndarray) -> tuple[list[int], Table]:
    """The joint of each landmark, in the order of `LANDMARKS`, and the table that names them.

    Where a table has several names, a joint that lies on its parent is passed over for the next one: cgspeed's `Neck`
    lies on `Spine1`, `Neck1` is at the neck's base.

    Args:
        where: the file.
        names: of the joints; the end of a chain as `<joint>/end`.
        offsets: of each joint from its parent, (J, 3).

    Raises:
        BadInput: no table has them all; the line names what is missing for the one that has most.
    """
    plain = [_plain(name) for name in names]
    best: tuple[list[str], Table] = (list(LANDMARKS), TABLES[0])
    for prefix in _prefixes(plain):
        cut = [name.removeprefix(prefix) for name in plain]
        for table in TABLES:
            found, missing = _matched(table, cut, offsets)
            if not missing:
                return found, table
            if len(missing) < len(best[0]):
                best = missing, table
    missing, table = best
    lack = f"none for {', '.join(missing[:6])}" + (" ..." if len(missing) > 6 else "")
    came = f"a skeleton with {lack}" if len(missing) < len(LANDMARKS) else "a skeleton that is not known"
    some = ", ".join(names[:6])
    wanted = f"a joint for each of the {len(LANDMARKS)} landmarks"
    raise BadInput(where, wanted, f"{came} (nearest: {table.name}; its joints begin {some})"[:400])


def _matched(table: Table, names: list[str], offsets: np.ndarray) -> tuple[list[int], list[str]]:
    """The joints of the landmarks, and the landmarks without one."""
    found, missing = [], []
    for landmark in LANDMARKS:
        held = [names.index(name) for name in table.names()[landmark] if names.count(name) == 1]
        apart = [joint for joint in held if np.linalg.norm(offsets[joint]) > 0]
        if held:
            found.append((apart or held)[0])
        else:
            missing.append(landmark)
    return found, missing


def _prefixes(names: list[str]) -> list[str]:
    """What may stand before all names: nothing, or what stands before a pelvis' name; the shortest first."""
    words = {word for table in TABLES for word in table.trunk["pelvis"]}
    found = {name.removesuffix(word) for name in names for word in words if name.endswith(word)} | {""}
    return sorted(found, key=lambda prefix: (len(prefix), prefix))[:_PREFIXES]


def _plain(name: str) -> str:
    """A name without case, namespace and signs; `/end` stays."""
    body, end = (name.removesuffix("/end"), "/end") if name.endswith("/end") else (name, "")
    return "".join(sign for sign in body.rsplit(":", 1)[-1].lower() if sign.isalnum()) + end
