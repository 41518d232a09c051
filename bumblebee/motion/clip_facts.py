"""Facts of a clip's file beside its arrays: name, rate, captions, source ..., each of its type."""

from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.names import require_stem
from bumblebee.io.read import decode, parse_json
from bumblebee.motion.captions import parse_caption
from bumblebee.motion.clip import Clip
from bumblebee.motion.texts import require_line

TEXTS = ("source", "licence", "sha256", "family", "split", "caption_source")
FACTS = ("captions", *TEXTS)
_KEYS = ("name", "fps", *FACTS)
_SPLITS = ("train", "test")


def facts_of(clip: Clip) -> dict[str, Any]:
    """The fields of a clip that are no arrays, as plain data."""
    return {key: getattr(clip, key) for key in _KEYS}


def read_facts(where: object, data: bytes) -> dict[str, Any]:
    """The fields of `Clip` that are no arrays, from JSON.

    Raises:
        BadInput: a key that is missing, unknown or of another type; a name that cannot name a file.
    """
    return require_facts(where, parse_json(where, decode(where, data)))


def require_facts(where: object, facts: Any) -> dict[str, Any]:
    """Require the facts of a clip from plain data."""
    if not isinstance(facts, dict):
        raise BadInput(where, "a table of facts about a clip", f"a {type(facts).__name__}")
    missing = [key for key in _KEYS if key not in facts]
    unknown = [key for key in facts if key not in _KEYS]
    if missing or unknown:
        came = f"none for {missing[0]}" if missing else f"the unknown key {unknown[0][:60]!r}"
        raise BadInput(where, f"facts {', '.join(_KEYS)}", came)
    require_stem(f"{where}: name", facts["name"])
    fps = facts["fps"]
    if isinstance(fps, bool) or not isinstance(fps, int | float):
        raise BadInput(f"{where}: fps", "frames a second", f"a {type(fps).__name__}")
    for key in TEXTS:
        require_line(f"{where}: {key}", facts[key])
    if facts["split"] not in _SPLITS:
        raise BadInput(f"{where}: split", " or ".join(_SPLITS), repr(facts["split"])[:60])
    captions = facts["captions"]
    if not isinstance(captions, list):
        raise BadInput(f"{where}: captions", "a list of captions", f"a {type(captions).__name__}")
    for number, line in enumerate(captions, 1):
        parse_caption(require_line(f"{where}: caption {number}", line), f"{where}: caption {number}")
    return {**facts, "captions": tuple(captions)}
