"""Who answers a gate, who may, and how many people have."""

import grp
import os
import pwd
import socket
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bumblebee.errors import BadInput

TERMINAL = "Answer in a terminal: `bumblebee gate approve`, `reject` or `more` knows who runs it."
OWN = ("unix user", "personal login")  # ways to know who answers
AUTOMATIC = "automatic (gate.mode: auto)"


@dataclass(frozen=True)
class Author:
    """Who answers, and how that is known."""

    by: str
    """The name that was given: a claim."""
    known_by: dict[str, Any] = field(default_factory=dict)
    """{"how": "unix user", "user", "uid", "host"}, {"how": "personal login", "user", "groups"}, {"how": "automatic"},
    or {"how": what else vouches for it}."""


ITSELF = Author(AUTOMATIC, {"how": "automatic"})


def unix_user(by: str) -> Author:
    """Whoever runs this process; the name that they give stands beside it."""
    uid = os.getuid()
    try:
        user = pwd.getpwuid(uid).pw_name
    except KeyError:  # a container may run under a number without a name
        user = str(uid)
    return Author(by, {"how": "unix user", "user": user, "uid": uid, "host": socket.gethostname()})


def personal(user: str, groups: Iterable[str]) -> dict[str, Any]:
    """How somebody was known who logged in on the servers' page under a name of their own."""
    return {"how": "personal login", "user": user, "groups": list(groups)}


def is_automatic(answer: Mapping[str, Any]) -> bool:
    """Whether the loop gave this answer itself; answers of before `known_by` say so by their name."""
    if "known_by" in answer:
        return bool(answer["known_by"].get("how") == ITSELF.known_by["how"])
    return bool(answer.get("by") == AUTOMATIC)


def login_of(answer: Mapping[str, Any]) -> str | None:
    """The login under which an answer was given; None where nothing but a claim is known of its author.

    A unix user and a personal login of the same name are the same person.
    """
    facts = answer.get("known_by") or {}
    return str(facts.get("user")) if facts.get("how") in OWN else None


def approvers(table: Mapping[str, Any]) -> list[str]:
    """Logins of those who approved what a request shows, each once."""
    given = [*table.get("approvals", []), *([table] if table.get("status") == "approved" else [])]
    logins = [login_of(answer) for answer in given]
    return list(dict.fromkeys(login for login in logins if login is not None))


def require_allowed(known_by: Mapping[str, Any], people: int, group: str, section: str = "gate") -> None:
    """Refuse an author of whom nothing is known where that matters, and one who is not in the group.

    Args:
        known_by: how the author was known, `gate.Author.known_by`.
        people: how many must approve.
        group: whose members alone may answer: a unix group, and people with this group; "" for everybody.
        section: of the settings that say so.

    Raises:
        BadInput: naming what is wanted.
    """
    if people == 1 and not group:
        return
    login = login_of({"known_by": known_by})
    if login is None:
        asked = f"a login of their own, as {section}.people and {section}.group ask"
        raise BadInput("the answer's author", asked, "none", TERMINAL)
    own = known_by.get("groups", ()) if known_by["how"] == "personal login" else None
    if group and not (group in own if own is not None else login in members(group, section)):
        raise BadInput("the answer's author", f"a member of the group {group} ({section}.group)", login)


def members(group: str, section: str = "gate") -> set[str]:
    """Logins of a unix group, those of whom it is the first group too.

    Raises:
        BadInput: if this machine has no such group.
    """
    try:
        found = grp.getgrnam(group)
    except KeyError:
        raise BadInput(
            f"{section}.group", "a group of this machine", repr(group), "Make it, or name another."
        ) from None
    first = {user.pw_name for user in pwd.getpwall() if user.pw_gid == found.gr_gid}
    own = pwd.getpwuid(os.getuid()).pw_name if os.getgid() == found.gr_gid else None
    return {*found.gr_mem, *first, *([own] if own else [])}
