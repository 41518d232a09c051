"""Evidence in the names of joints: words for a role, and the side where two names differ in nothing else.

Case, signs, namespaces and whatever else surrounds a word do not count: `mixamorig:LeftUpLeg`, `Bip01 L Thigh`,
`UpperLeg_L` and `l_up_leg` all say hip of the left leg.
"""

import re

END = "/end"
"""Stands behind the name of a joint whose chain ends: the end itself has no name."""
SURE, WEAK, AGAINST = 2, 1, -2
"""Weights of a word that means the role, that may mean it, and that means another one."""

_SAID = {
    "pelvis": "pelvis hips hip",
    "chest": "chest spine torso thorax",
    "neck": "neck",
    "head": "head",
    "hip": "upleg upperleg thigh femur hips hip leg?",
    "knee": "lowleg lowerleg shin calf shank tibia knee leg?",
    "ankle": "ankle foot?",
    "toe": "toe ball foot?",
    "shoulder": "uparm upperarm uarm shldr humerus arm shoulder?",
    "elbow": "forearm lowarm lowerarm farm elbow arm?",
    "wrist": "wrist hand?",
}
"""The words of each role; `?` marks one that may mean another role of the same limb, too."""
_WORDS: dict[str, dict[str, int]] = {}
for _role, _said in _SAID.items():
    for _word in _said.split():
        _WORDS.setdefault(_word.rstrip("?"), {})[_role] = WEAK if _word.endswith("?") else SURE
_SIDES = {("l", "r"): 1, ("lef", "righ"): 1, ("r", "l"): -1, ("righ", "lef"): -1}
_TWIST = re.compile(r"(twist|roll)\d*[lr]?$")


def plain(name: str) -> str:
    """A name in small letters and digits, without its namespace; "" for the end of a chain."""
    return "" if name.endswith(END) else "".join(sign for sign in name.rsplit(":", 1)[-1].lower() if sign.isalnum())


def is_twist(text: str) -> bool:
    """Whether a plain name is one of a joint that only turns its bone about itself."""
    return bool(_TWIST.search(text))


def weight(role: str, text: str) -> int:
    """How much a plain name speaks for a role: its longest word decides, of equally long ones the last."""
    words = [(len(word), text.rfind(word), word) for word in _WORDS if word in text]
    return _WORDS[max(words)[2]].get(role, AGAINST) if words else 0


def side_of(one: str, other: str) -> int:
    """1 where two plain names are a left and a right joint's, -1 where they are a right and a left one's, else 0."""
    start = _alike(one, other)
    end = _alike(one[start:][::-1], other[start:][::-1])
    return _SIDES.get((one[start : len(one) - end], other[start : len(other) - end]), 0)


def _alike(one: str, other: str) -> int:
    """How many signs two texts begin alike with."""
    return next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))
