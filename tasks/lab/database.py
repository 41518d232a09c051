"""A database in one file of SQLite's that appears whole: made beside its place, and renamed when it is finished.

So a kill at any moment leaves none or a whole one. What an older version left half made is made again where nothing is
in it; where something is, a copy is brought up to date beside it, and the old file is kept.
"""

import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from bumblebee.errors import BadInput
from tasks.lab.checks import revisions
from tasks.lab.private import put_aside


def ensure(path: Path, program: str, update: Callable[[Path], None]) -> None:
    """See that the file holds all tables that the installed program wants; the caller holds a lock.

    Args:
        path: the database.
        program: whose, of `lab_checks.MIGRATIONS`.
        update: makes the tables in a file that is not there yet, or brings those in a file up to date.

    Raises:
        BadInput: for what is no database, has tables of a newer version, or cannot be brought up to date.
    """
    known, newest = revisions(program)
    there = revision(path) if path.exists() else ""
    if there in newest:
        return
    if there and there not in known:
        raise unusable(path, f"tables that this version of {program} knows", f"newer ones ({there})")
    folder = path.with_name(f".{path.name}.new")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(mode=0o700)
    fresh = folder / path.name
    update(fresh)
    if path.exists() and _holds_more(path, fresh):
        fresh.unlink()
        _update_copy(path, fresh, program, update)
        old = path.with_name(f"{path.name}.{there or 'unknown'}")
        shutil.copyfile(path, old)
    for end in ("-journal", "-wal", "-shm"):  # what belonged to a file that is gone would be read into the new one
        path.with_name(path.name + end).unlink(missing_ok=True)
    fresh.replace(path)
    shutil.rmtree(folder)


def revision(path: Path) -> str:
    """The version of a database's tables, as Alembic notes it; "" where it notes none.

    Raises:
        BadInput: for what is no database of SQLite's, or cannot be read.
    """
    try:
        with closing(sqlite3.connect(path)) as opened:
            noted = opened.execute("SELECT 1 FROM sqlite_master WHERE name = 'alembic_version'").fetchone()
            row = opened.execute("SELECT version_num FROM alembic_version").fetchone() if noted else None
    except sqlite3.Error as error:
        raise unusable(path, "a database", str(error)) from None
    return str(row[0]) if row else ""


def unusable(path: Path, expected: str, came: str) -> BadInput:
    """The line for a database that nothing can be made of, with what always leads on."""
    do = f"{put_aside(path)}, then start again: a new one begins, the old one is kept."
    return BadInput(path, expected, came, do)


def _update_copy(path: Path, copy: Path, program: str, update: Callable[[Path], None]) -> None:
    with closing(sqlite3.connect(path)) as source, closing(sqlite3.connect(copy)) as target:
        source.backup(target)
    try:
        update(copy)
    except Exception as error:  # whatever the program's migrations raise
        came = f"one that was left half made ({' '.join(str(error).split())[:120]})"
        raise unusable(path, f"tables that {program} can bring up to date", came) from None


def _holds_more(path: Path, fresh: Path) -> bool:
    """Whether a table of a database has more rows than a new database has."""
    mine, new = _rows(path), _rows(fresh)
    return any(count > new.get(name, 0) for name, count in mine.items())


def _rows(path: Path) -> dict[str, int]:
    with closing(sqlite3.connect(path)) as opened:
        names = [name for (name,) in opened.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        return {name: opened.execute(f'SELECT count(*) FROM "{name}"').fetchone()[0] for name in names}
