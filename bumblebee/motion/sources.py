"""Where a motion's bytes come from: a file, or a member of an archive."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Source:
    """One motion file to be read, on disk or in an archive."""

    path: Path
    """As it is shown, and by whose name and suffix it is read; a member: the archive's path joined with its name."""
    read: Callable[[int], bytes]
    """Its bytes; refuses (BadInput) more than the given number of them."""
    archive: Path | None = None
    """The archive that it is a member of."""
