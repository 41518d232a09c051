"""Refusal of a path at which no motion can be used."""

from collections.abc import Sequence
from pathlib import Path

from bumblebee.errors import BadInput

_LONGEST = 1500  # signs of what came


def nothing(path: Path, expected: str, skipped: Sequence[tuple[str, str]], do: str = "") -> BadInput:
    """The error: of a single file its own reason, of a folder the first one's.

    Args:
        path: a file, a folder or an archive.
        expected: what was sought there.
        skipped: place and reason of everything at `path`.
        do: what the user can do about a folder.
    """
    if not Path(path).is_dir() and len(skipped) == 1:
        own, known, came = skipped[0][1].removeprefix("expected ").partition(", came ")
        return BadInput(path, own, came[:_LONGEST]) if known else BadInput(path, expected, own[:_LONGEST])
    first = ": ".join(skipped[0]).removesuffix("." if do else "") if skipped else ""
    return BadInput(path, expected, f"none that can be used; the first: {first}"[:_LONGEST] if first else "none", do)
