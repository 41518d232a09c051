"""Lines of text that come with motions: captions, sources, licences, names of files."""

from bumblebee.errors import BadInput

LONGEST = 4000  # characters: a caption with its tokens has a few hundred


def require_line(where: object, text: object, most: int = LONGEST) -> str:
    """`text` itself where it is one line of at most `most` characters, without control characters."""
    if not isinstance(text, str):
        raise BadInput(where, "text", f"a {type(text).__name__}")
    if len(text) > most:
        raise BadInput(where, f"at most {most:,} characters", f"{len(text):,}")
    if any(_unshown(sign) for sign in text):
        raise BadInput(where, "one line of text without control characters", repr(text[:60]))
    return text


def shown(text: str, most: int = 300) -> str:
    """The text with a mark in place of what is no text (bytes of a name that are not UTF-8, control characters)."""
    return "".join("\ufffd" if _unshown(sign) else sign for sign in text[:most])


def _unshown(sign: str) -> bool:
    code = ord(sign)
    return (code < 32 and sign != "\t") or 127 <= code < 160 or 0xD800 <= code < 0xE000 or code in (0x2028, 0x2029)
