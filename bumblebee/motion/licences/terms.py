"""Terms of the licences of motions: commercial use, and what must be said of whatever is made from them."""

import re
from collections.abc import Iterable, Mapping

UNKNOWN = "unknown"

# What licences that forbid commercial use are called, and those that allow it.
_NONCOMMERCIAL = re.compile(
    r"non-?\s?commercial|\bby-nc\b|\bcc[ -]by[ -]nc|\b(research|academic)( use| purposes)? only", re.IGNORECASE
)
_COMMERCIAL = re.compile(
    r"\b(mit|isc|apache|bsd|0bsd|zlib|unlicense|cc0|cc[ -]by|public domain|[al]?gpl|mpl)\b", re.IGNORECASE
)


def noncommercial(licence: str) -> bool | None:
    """Whether a licence, or its text, forbids commercial use; None where it does not tell."""
    if _NONCOMMERCIAL.search(licence):
        return True
    return False if _COMMERCIAL.search(licence) else None


def counted(licences: Iterable[str | None]) -> dict[str, int]:
    """How many motions have each licence, the most frequent first; "" and None are unknown."""
    counts: dict[str, int] = {}
    for licence in licences:
        counts[licence or UNKNOWN] = counts.get(licence or UNKNOWN, 0) + 1
    return dict(sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])))


def restrictions(counts: Mapping[str, int]) -> list[str]:
    """One line for each reason against commercial use of what was trained on such motions; none where all allow it.

    Args:
        counts: licence -> motions, as `counted` has it.
    """
    forbid = [licence for licence in counts if noncommercial(licence)]
    silent = [licence for licence in counts if noncommercial(licence) is None and licence != UNKNOWN]
    unknown = counts.get(UNKNOWN, 0)
    lines = []
    if forbid:
        lines.append(f"trained on motions that may not be used commercially: {'; '.join(forbid)}")
    if silent:
        lines.append(f"read these licences before commercial use, whose names do not settle it: {'; '.join(silent)}")
    if unknown:
        lines.append(f"licence unknown for {unknown} motion{'s' * (unknown != 1)}: ask before commercial use")
    return lines
