"""Names that come from data, before they become names of files: one component, no way out of the folder, no loss."""

import re
import unicodedata
from collections.abc import Sequence

from bumblebee.errors import BadInput

LONGEST = 120  # bytes of a name; file systems take 255, and endings and prefixes come on top


def safe_stem(text: object, fallback: str = "unnamed") -> str:
    """`text` as one name of a file without ending: letters, digits, `.`, `_`, `-`, never empty, never hidden.

    What stands between other signs is kept: `a/../b` becomes `a_b`. Two texts may come out alike: `distinct_stems`.
    """
    plain = unicodedata.normalize("NFC", str(text))
    plain = re.sub(r"[^\w.+-]+", "_", plain, flags=re.UNICODE)
    plain = re.sub(r"(?:^|(?<=_))\.+(?=_|$)", "", plain)  # components that are nothing but dots
    plain = re.sub(r"_+", "_", plain).strip("_").lstrip(".-")
    while len(plain.encode()) > LONGEST:
        plain = plain[:-1]
    return plain or fallback


def require_stem(where: object, text: object, longest: int = LONGEST) -> str:
    """`text` itself where it can name a file as it stands."""
    if not isinstance(text, str) or not text or text.startswith("."):
        raise BadInput(where, "a name that does not begin with a dot", repr(text)[:80])
    if len(text.encode("utf-8", "replace")) > longest:
        raise BadInput(where, f"a name of 1 to {longest} bytes", repr(text)[:80])
    if any(sign in "/\\" or ord(sign) < 32 or ord(sign) == 127 or 0xD800 <= ord(sign) < 0xE000 for sign in text):
        raise BadInput(where, "a name without slashes and control characters", repr(text)[:80])
    return text


def distinct_stems(texts: Sequence[object], fallback: str = "unnamed") -> list[str]:
    """A safe name for each text, no two alike, also where the file system does not tell cases apart."""
    taken: set[str] = set()
    last: dict[str, int] = {}  # so that a hundred thousand texts of one stem need no search each
    out = []
    for text in texts:
        name = stem = safe_stem(text, fallback)
        number = last.get(stem.casefold(), 1)
        while name.casefold() in taken:
            number += 1
            name = f"{stem}-{number}"
        last[stem.casefold()] = number
        taken.add(name.casefold())
        out.append(name)
    return out
