"""Lines of text that come with motions: captions, sources, licences, names of files."""

import re

from bumblebee.errors import BadInput

# Control characters but the tab, halves of surrogate pairs, Unicode's line breaks.
_UNSHOWN = re.compile(r"[\x00-\x08\x0a-\x1f\x7f-\x9f\ud800-\udfff\u2028\u2029]")
LONGEST = 4000  # characters: a caption with its tokens has a few hundred


def require_line(where: object, text: object, most: int = LONGEST) -> str:
    """`text` itself where it is one line of at most `most` characters, without control characters."""
    if not isinstance(text, str):
        raise BadInput(where, "text", f"a {type(text).__name__}")
    if len(text) > most:
        raise BadInput(where, f"at most {most:,} characters", f"{len(text):,}")
    if _UNSHOWN.search(text):
        raise BadInput(where, "one line of text without control characters", repr(text[:60]))
    return text


def shown(text: str, most: int = 300) -> str:
    """The text with a mark in place of what is no text (bytes of a name that are not UTF-8, control characters)."""
    return _UNSHOWN.sub("\ufffd", text[:most])
