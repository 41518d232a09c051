"""Which lines of what a loop says tell of a fault, and what each of them is called."""

import re

TELLS = re.compile(
    r"error|exception|traceback|failed|expected|lost|went away|refused|no space|disk|crash|timed out|cannot|could not|"
    r"ending|gone|not started|hung|denied|unavailable|retry",
    re.IGNORECASE,
)
TRACEBACK = "Traceback (most recent call last)"
LINES, LENGTH = 200, 400

Named = tuple[re.Pattern[str], tuple[str, ...]]
NAMED: dict[str, Named] = {}
"""Name -> the lines that it means, and the faults of which one must have been there; none for what is no error."""


def telling(text: str) -> list[str]:
    """Lines that tell of a fault, each shape once, without their time; of a traceback its head and its error."""
    found: dict[str, str] = {}
    inside = False
    for line in text.splitlines():
        plain = re.sub(r"^\d\d:\d\d:\d\d(\.\d+)? ", "", line)
        inside = (inside and plain.startswith(" ")) or plain.startswith(TRACEBACK)
        if TELLS.search(plain) and (not inside or plain.startswith(TRACEBACK)):
            plain = plain.strip()[:LENGTH]
            found.setdefault(re.sub(r"[0-9a-f]{6,}|\d+", "#", plain), plain)
    return list(found.values())[:LINES]


def name_of(line: str) -> str | None:
    """What the line is called; None for one that nobody has named."""
    return next((name for name, (pattern, _) in NAMED.items() if pattern.search(line)), None)
