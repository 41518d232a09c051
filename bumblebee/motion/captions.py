"""Captions in HumanML3D's line format: `a person walks.#a/DET person/NOUN walk/VERB#0.0#0.0`, times in seconds."""

import math
import re

from bumblebee.errors import BadInput
from bumblebee.motion.texts import require_line

_LONGEST_TIME = 1e6  # s

# What a word in a file's name says about the kind of motion; the first that is found decides.
_FAMILIES = (
    ("jump", ("jump", "hop", "leap")),
    ("balance", ("balance",)),
    ("kick", ("kick",)),
    ("squat", ("squat", "crouch", "sit")),
    ("walk", ("walk", "walking", "jazzwalk")),
    ("step", ("step", "steps")),
    ("run", ("run", "running", "jog", "sprint")),
    ("turn", ("turn", "turns")),
    ("dance", ("dance",)),
    ("karate", ("karate", "chops", "chop", "punch")),
    ("fence", ("fence", "fencing")),
    ("shoot", ("shoot",)),
    ("stand", ("stand", "standing", "hands")),
)


def parse_caption(line: str, where: object = "caption") -> tuple[str, str, float, float]:
    """Caption, tokens, from [s], to [s]; 0 and 0 mean the whole motion."""
    parts = require_line(where, line).split("#")
    if len(parts) != 4 or not parts[0].strip():
        raise BadInput(where, "caption#tokens/POS#from#to", repr(line)[:80])
    try:
        # HumanML3D itself writes nan for "unknown": the whole motion.
        start, end = (0.0 if part.strip().lower() == "nan" else float(part) for part in parts[2:])
    except ValueError:
        raise BadInput(where, "times in seconds after the tokens", f"{parts[2]!r} and {parts[3]!r}"[:80]) from None
    if not all(math.isfinite(time) and 0 <= time <= _LONGEST_TIME for time in (start, end)):
        raise BadInput(where, f"times from 0 to {_LONGEST_TIME:g} s", f"{parts[2]!r} and {parts[3]!r}"[:80])
    return parts[0].strip(), parts[1].strip(), start, end


def caption_from_name(name: str) -> str:
    """A caption made of the words of a file's name."""
    text = words(name)[:40] or ["move"]
    tokens = " ".join(["a/DET", "person/NOUN", "perform/VERB", *(f"{word}/OTHER" for word in text)])
    return f"a person performs {' '.join(text)}#{tokens}#0.0#0.0"


def words(name: str) -> list[str]:
    """Lower-case words of a name: `J_Dance11_Gnarly` -> dance, gnarly; numbers and single letters are dropped."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    found = [word.lower() for word in re.findall(r"[A-Za-z]+", spaced)]
    return [word for word in found if len(word) > 1 and word != "level"]


def family_of(name: str) -> str:
    """The kind of motion that a file's name suggests, "" if none."""
    found = set(words(name))
    return next((family for family, signs in _FAMILIES if found & set(signs)), "")
