"""The people who may use a workspace's servers from elsewhere: names, groups, and salted hashes of their passwords.

A password is made here, shown once, and known to nobody afterwards. The list is read again whenever it changes: who is
removed is out at once. After a few wrong passwords a name waits; whoever is in already does not notice.
"""

import asyncio
import fcntl
import hashlib
import hmac
import json
import os
import re
import secrets
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.read import read_json
from flows.people import login

FILE = "people.json"  # beside the servers' own login
NAME = re.compile(r"[a-z][a-z0-9_-]{0,31}")
COST = {"n": 1 << 14, "r": 8, "p": 1}  # of scrypt: 16 MiB and some 50 ms for each password that is tried
WRONG = 5  # passwords for one name, then it waits
WAIT = 60.0  # [s]
AT_ONCE, QUEUE = 2, 32  # passwords that are tried at once, and that may wait for it
REMEMBERED = 1000  # logins that were right, and names that were not


class Busy(Exception):
    """Too many wrong passwords for this name, or too many at once: later."""


@dataclass(frozen=True)
class Person:
    """Somebody who may use the servers."""

    name: str
    """Name of the login; that of the person's unix login here, where there is one: both are one person at a gate."""
    groups: tuple[str, ...]
    """Groups that `gate.group`, `serve.write` and `serve.promote` are compared with."""
    salt: str
    """Salt of the hash, in hex."""
    hash: str
    """scrypt of the password, in hex."""

    def fits(self, password: str) -> bool:
        """Whether this is the password."""
        return hmac.compare_digest(hashed(password, self.salt), self.hash)


NOBODY = Person("", (), "00" * 16, "00" * 32)


def hashed(password: str, salt: str) -> str:
    """Scrypt of a password, in hex."""
    return hashlib.scrypt(password.encode(), salt=bytes.fromhex(salt), **COST, dklen=32, maxmem=1 << 26).hex()


def read(folder: Path) -> dict[str, Person]:
    """Everybody in the list, by name; empty where there is none.

    Raises:
        BadInput: for a list that others could have read or written, or that is none.
    """
    path = folder / FILE
    if not path.exists():
        return {}
    found = path.lstat()
    if path.is_symlink() or found.st_uid != os.geteuid() or found.st_mode & 0o077:
        raise BadInput(path, "a file of your own that nobody else can read", "another", "Remove it, add people again.")
    content = read_json(path)
    try:
        people = [Person(**{**one, "groups": tuple(one["groups"])}) for one in content["people"]]
        if any(len(bytes.fromhex(one.salt)) < 16 or len(bytes.fromhex(one.hash)) != 32 for one in people):
            raise ValueError
        return {one.name: one for one in people if NAME.fullmatch(one.name)}
    except (TypeError, KeyError, ValueError):
        raise BadInput(path, "a list that `bumblebee lab user` wrote", "something else") from None


def add(folder: Path, name: str, groups: tuple[str, ...] = ()) -> str:
    """Put somebody into the list; the new password.

    Raises:
        BadInput: for a name or group of another form, or one that is there.
    """
    for what, text in (("the name", name), *(("--group", group) for group in groups)):
        if not NAME.fullmatch(text):
            raise BadInput(what, "a small letter, then up to 31 of a-z 0-9 _ -", repr(text)[:80])
    if name == login.USER:
        raise BadInput("the name", "a person's", f"{name}, of the workspace's own login")
    with _changing(folder) as people:
        if name in people:
            raise BadInput("the name", "a new one", f"{name}, which is there", "For a new password remove it first.")
        password, salt = secrets.token_urlsafe(24), secrets.token_hex(16)
        people[name] = Person(name, tuple(sorted(set(groups))), salt, hashed(password, salt))
    return password


def remove(folder: Path, name: str) -> None:
    """Take somebody off the list.

    Raises:
        BadInput: when nobody has this name.
    """
    with _changing(folder) as people:
        if people.pop(name, None) is None:
            raise BadInput("the name", " or ".join(sorted(people)) or "somebody in the list", name[:80])


@contextmanager
def _changing(folder: Path) -> Iterator[dict[str, Person]]:
    """The list to change, written when the block ends well; one process at a time."""
    login.private(folder)
    with (folder / ".people.lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        people = read(folder)
        yield people
        text = json.dumps({"people": [asdict(people[name]) for name in sorted(people)]}, indent=1)
        login.write_private(folder / FILE, text + "\n")


class People:
    """The list as a server asks it.

    Args:
        folder: where it lies.
        clock: seconds that only grow.
    """

    def __init__(self, folder: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self.folder, self.clock = folder, clock
        self.seen: tuple[int, ...] = ()
        self.list: dict[str, Person] = {}
        self.secret = secrets.token_bytes(32)
        self.right: dict[str, Person] = {}  # by a keyed hash of name and password, which tells neither
        self.wrong: dict[str, tuple[int, float]] = {}  # how often, and when last
        self.trying, self.waiting = asyncio.Semaphore(AT_ONCE), 0

    def known(self, name: str) -> Person | None:
        """Somebody as the list has them now; None once they are removed."""
        try:
            found = (self.folder / FILE).stat()
            seen = (found.st_mtime_ns, found.st_ino, found.st_size)
            if seen != self.seen:
                self.list, self.seen = read(self.folder), seen
        except (OSError, BadInput):
            self.list, self.seen = {}, ()
        return self.list.get(name)

    async def person(self, pair: str) -> Person | None:
        """Who logs in with `name:password`; None where nobody does.

        Raises:
            Busy: after `WRONG` wrong passwords for this name within `WAIT` seconds, or when too many are being tried.
        """
        name, _, password = pair.partition(":")
        if not NAME.fullmatch(name):
            return None
        known = self.known(name)
        key = hmac.new(self.secret, pair.encode("utf-8", "replace"), hashlib.sha256).hexdigest()
        if known is not None and self.right.get(key) == known:
            return known
        times, last = self.wrong.get(name, (0, 0.0))
        if self.clock() - last >= WAIT:
            times = 0
        if times >= WRONG or self.waiting >= QUEUE:
            raise Busy
        self.wrong[name] = (times + 1, self.clock())  # counts before it is tried: many at once are many
        _forget(self.wrong)
        if not await self._fits(known or NOBODY, password) or known is None:
            return None
        self.wrong.pop(name, None)
        self.right[key] = known
        _forget(self.right)
        return known

    async def _fits(self, person: Person, password: str) -> bool:
        self.waiting += 1
        try:
            async with self.trying:
                return await asyncio.to_thread(person.fits, password[:200])
        finally:
            self.waiting -= 1


def _forget(table: dict[str, Person] | dict[str, tuple[int, float]]) -> None:
    """Keep a table short: what was put in first goes first."""
    while len(table) > REMEMBERED:
        table.pop(next(iter(table)))
