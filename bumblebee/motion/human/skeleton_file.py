"""A file that says which joint of a skeleton stands for which landmark: YAML that `bumblebee motions inspect` prints.

A table of the 18 landmarks, each with the name of a joint, or a list of such tables for folders with several skeletons.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from bumblebee.errors import BadInput
from bumblebee.io.read import parse_yaml, read_text
from bumblebee.motion.human.motion import LANDMARKS, Role

_FORM = f"a table of the {len(LANDMARKS)} landmarks and their joints' names, or a list of such tables"


@dataclass(frozen=True)
class Stated:
    """The content of a mapping file: for each skeleton the joints' names in the order of `LANDMARKS`."""

    where: str
    skeletons: tuple[tuple[str, ...], ...]


def read_stated(path: str | Path) -> Stated:
    """The skeletons of a mapping file.

    Raises:
        BadInput: no such file; a key that is no landmark, a landmark without a joint.
    """
    path = Path(path).expanduser()
    try:
        stat = path.stat()
    except OSError:
        raise BadInput(path, "a file that says which joint is which", "no such file") from None
    return _read(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=4)
def _read(path: Path, changed: int, size: int) -> Stated:
    """Read once for all files of a folder; anew when the file was changed."""
    content = parse_yaml(path, read_text(path))
    tables = content if isinstance(content, list) else [content]
    if not tables:
        raise BadInput(path, _FORM, "an empty list")
    places = [f"{path}, skeleton {number}" if len(tables) > 1 else str(path) for number in range(1, len(tables) + 1)]
    return Stated(path.name, tuple(_table(where, table) for where, table in zip(places, tables, strict=True)))


def _table(where: str, table: Any) -> tuple[str, ...]:
    if not isinstance(table, dict):
        raise BadInput(where, _FORM, "nothing" if table is None else f"a {type(table).__name__}")
    unknown = [str(key)[:40] for key in table if key not in LANDMARKS]
    if unknown:
        raise BadInput(where, f"keys among {', '.join(LANDMARKS)}", repr(unknown[0]))
    missing = [name for name in LANDMARKS if table.get(name) is None]
    if missing:
        raise BadInput(where, f"the name of a joint for {', '.join(missing)}", "none")
    for name in LANDMARKS:
        if not isinstance(table[name], str):
            raise BadInput(f"{where}: {name}", "the name of a joint, in quotes where it looks like another value",
                           repr(table[name])[:40])  # fmt: skip
    return tuple(table[name] for name in LANDMARKS)


def joints_stated(where: object, stated: Stated, names: Sequence[str]) -> tuple[int, ...]:
    """The joints (18,) of the first skeleton of a mapping file that a file with joints of these names has.

    Raises:
        BadInput: a joint of the skeleton that fits best is not there, or is there twice.
    """
    lacks = [
        [(role, name) for role, name in zip(LANDMARKS, skeleton, strict=True) if names.count(name) != 1]
        for skeleton in stated.skeletons
    ]
    fits = min(range(len(lacks)), key=lambda i: len(lacks[i]))
    if lacks[fits]:
        role, name = lacks[fits][0]
        came = "none" if name not in names else f"{names.count(name)} of that name"
        raise BadInput(where, f"a joint {name!r} as {role}, as {stated.where} says", came,
                       f"Its joints: {', '.join(name for name in names)}"[:300])  # fmt: skip
    return tuple(names.index(name) for name in stated.skeletons[fits])


def table_of(roles: Sequence[Role]) -> str:
    """The roles of one skeleton as an item of a mapping file, the evidence beside; what has no joint is left open."""
    lines = []
    for role in roles:
        value = yaml.safe_dump(role.joint, width=1000, allow_unicode=True).partition("\n")[0] if role.joint else ""
        lines.append(f"{role.landmark}: {value}".rstrip() + f"  # {role.evidence or 'no joint found: name one'}")
    return "\n".join(("- " if not i else "  ") + line for i, line in enumerate(lines))
