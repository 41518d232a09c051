"""Who may use a workspace's servers: one random login, in a file that only the owner of the workspace can read."""

import base64
import os
import re
import secrets
import stat
from pathlib import Path

from tasks.lab.private import private

__all__ = ["NAME", "USER", "ensure", "header", "pair", "private", "read", "write_private"]

USER = "bumblebee"
NAME = "login"  # the file, one line `user:password`, as Prefect's page asks for it
_LINE = re.compile(rf"{USER}:([A-Za-z0-9_-]{{40,}})\n")


def ensure(folder: Path) -> str:
    """The password of the servers in `folder`: the one that is there, or a new one.

    One that others could have read, or that is not the owner's, is replaced.
    """
    known = read(folder)
    if known is not None:
        return known
    path = folder / NAME
    path.unlink(missing_ok=True)
    password = secrets.token_urlsafe(32)
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
    with os.fdopen(handle, "w", encoding="ascii") as stream:
        stream.write(f"{USER}:{password}\n")
    return password


def read(folder: Path) -> str | None:
    """The password in `folder`, or None where there is none that only the owner could read."""
    try:
        handle = os.open(folder / NAME, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return None
    with os.fdopen(handle, "rb") as stream:
        found = os.fstat(stream.fileno())
        own = stat.S_ISREG(found.st_mode) and found.st_uid == os.geteuid() and not found.st_mode & 0o077
        match = _LINE.fullmatch(stream.read(200).decode("ascii", "replace")) if own else None
    return match[1] if match else None


def write_private(path: Path, text: str) -> None:
    """Write a file whole, for its owner only."""
    part = path.with_name(f".{path.name}.{os.getpid()}")
    part.unlink(missing_ok=True)
    with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as stream:
        stream.write(text)
    part.replace(path)


def pair(password: str) -> str:
    """`user:password`, as Prefect's page and client take it."""
    return f"{USER}:{password}"


def header(password: str) -> str:
    """The value of the header Authorization."""
    return "Basic " + base64.b64encode(pair(password).encode()).decode()
