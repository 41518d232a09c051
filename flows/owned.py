"""Whose workspace it is: dvc.yaml holds commands, so that who may change or replace it decides what runs."""

import grp
import os
import pwd
import stat
from collections.abc import Iterator
from pathlib import Path
from shlex import join

from bumblebee.errors import BadInput

DECIDING = ("", "dvc.yaml", "dvc.lock", "params.yaml", ".dvc", ".dvc/config", ".dvc/config.local")
ACL = "system.posix_acl_access"


def require_own(folder: Path) -> None:
    """Refuse a workspace in which somebody else decides what runs; nothing of it has been read before.

    Asked of every file that decides, and of every folder and link on the way to it.

    Raises:
        BadInput: when one belongs to another user than this one or root, or another may write it.
    """
    open_ones = []
    for path in ways(folder):
        found = path.lstat()
        if found.st_uid not in {0, *_mine()}:
            remedy = "Copy it into a folder of yours if you trust it."
            raise BadInput(path, "a workspace of your own", f"one that user {found.st_uid} owns", remedy)
        if not stat.S_ISLNK(found.st_mode) and (who := _others(path, found)):
            open_ones.append((path, who))
    if open_ones:
        (path, who), paths = open_ones[0], [str(one) for one, _ in open_ones]
        mine = os.geteuid() == 0 or all(one.stat().st_uid == os.geteuid() for one, _ in open_ones)
        do = join(["chmod", "go-w", *paths]) if mine else "Copy the workspace into a folder of yours."
        raise BadInput(path, "a workspace that only you can change", f"one that {who} can write", do)


def ways(folder: Path) -> Iterator[Path]:
    """All that decides what runs in a workspace, as far as it is there, with what it is reached through, links too."""
    waiting = [Path(os.path.abspath(folder / name)) for name in DECIDING]
    seen: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path in seen or not os.path.lexists(path):
            continue
        seen.add(path)
        yield path
        waiting += [] if path == path.parent else [path.parent]
        if path.is_symlink():
            waiting.append(Path(os.path.abspath(os.path.join(os.path.realpath(path.parent), os.readlink(path)))))


def _others(path: Path, found: os.stat_result) -> str:
    """Who else may write a file, or replace what lies in a folder; "" for nobody."""
    if stat.S_ISDIR(found.st_mode) and found.st_mode & stat.S_ISVTX:
        return ""  # as /tmp: each may replace their own files alone
    if found.st_mode & stat.S_IWOTH:
        return "everybody"
    if found.st_mode & stat.S_IWGRP and not _alone(found.st_gid, path):
        return "its group"
    return ""


def _alone(group: int, path: Path) -> bool:
    """Whether the group is the owner's private one, as most systems have it: named after them, and without others."""
    try:
        names = {pwd.getpwuid(user).pw_name for user in _mine()}
        found = grp.getgrgid(group)
    except KeyError:
        return False
    extended = hasattr(os, "listxattr") and ACL in os.listxattr(path)  # the group's bits are then those of all named
    return found.gr_name in names and set(found.gr_mem) <= names and not extended


def _mine() -> set[int]:
    """Who counts as the owner: this user; under sudo also the one who called it."""
    caller = os.environ.get("SUDO_UID", "") if os.geteuid() == 0 else ""
    return {os.geteuid(), *([int(caller)] if caller.isdigit() else [])}
