"""Whether a command's input is there, asked before anything is imported that takes seconds."""

import os
from pathlib import Path

from bumblebee.errors import BadInput


def require_there(path: Path, expected: str, do: str = "") -> None:
    """`BadInput` where nothing lies at `path`."""
    if not os.path.lexists(path):  # False for a name that the system refuses, too
        raise BadInput(path, expected, "no such file or folder", do)


def require_motions(path: Path) -> None:
    """`BadInput` where no folder with motion files, and no such file, lies at `path`."""
    require_there(path, "a folder with motion files, or a motion file")
