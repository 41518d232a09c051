"""Lines of the checks for a person: those that differ by recording, joint and numbers alone are told once."""

import re
from collections.abc import Sequence

_PLACE = re.compile(r"\[[^\]]*\]|, row \d+")


def told_once(lines: Sequence[str]) -> list[str]:
    """The first line of each column and rule, with the number of others and the recordings that they are of."""
    alike: dict[str, list[str]] = {}
    for line in lines:
        alike.setdefault(_PLACE.sub("", _where(line)) or line, []).append(line)
    return [_with_count(same) for same in alike.values()]


def _where(line: str) -> str:
    """Column and rule of `FILE: column C: rule R: expected ...`; empty where the line has none."""
    place, found, _ = line.partition(": expected ")
    return place.partition(": column ")[2] if found else ""


def _with_count(lines: Sequence[str]) -> str:
    if len(lines) == 1:
        return lines[0]
    files = dict.fromkeys(line.partition(": column ")[0] for line in lines)
    where = f"in {len(files)} recordings" if len(files) > 1 else "in this recording"
    return f"{lines[0]} ({len(lines)} alike {where})"
