"""Whose workspace it is: dvc.yaml holds commands, so that who writes it decides what runs."""

import os
import stat
from pathlib import Path

from bumblebee.errors import BadInput

DECIDING = ("", "dvc.yaml", "dvc.lock", "params.yaml", ".dvc", ".dvc/config", ".dvc/config.local")


def require_own(folder: Path) -> None:
    """Refuse a workspace in which somebody else decides what runs; nothing of it has been read before.

    Raises:
        BadInput: when the folder, or a file in it that decides, belongs to another user or may be written by all.
    """
    for name in DECIDING:
        path = folder / name
        try:
            found = path.stat()
        except OSError:
            continue
        if found.st_uid not in _mine():
            remedy = "Copy it into a folder of yours if you trust it."
            raise BadInput(path, "a workspace of your own", f"one that user {found.st_uid} owns", remedy)
        if found.st_mode & stat.S_IWOTH:
            raise BadInput(
                path, "a workspace that only you can change", "one that everybody can write", "chmod o-w it."
            )


def _mine() -> set[int]:
    """Who counts as the owner: this user; under sudo also the one who called it."""
    caller = os.environ.get("SUDO_UID", "") if os.geteuid() == 0 else ""
    return {os.geteuid(), *([int(caller)] if caller.isdigit() else [])}
