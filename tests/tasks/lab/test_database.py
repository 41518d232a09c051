"""A workspace's database appears whole or not at all, whenever the process that makes it is killed."""

import os
import shlex
import sqlite3
import subprocess
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from tasks import registry
from tasks.lab import database

KNOWN = {"a1", "b2", "c3"}
STEPS = (  # of a program whose newest tables are c3
    "CREATE TABLE alembic_version (version_num TEXT)",
    "CREATE TABLE runs (name TEXT)",
    "INSERT INTO alembic_version VALUES ('a1')",
    "ALTER TABLE runs ADD COLUMN seconds REAL",
    "UPDATE alembic_version SET version_num = 'b2'",
    "CREATE TABLE kinds (name TEXT)",
    "INSERT INTO kinds VALUES ('usual')",
    "UPDATE alembic_version SET version_num = 'c3'",
)


@pytest.fixture(autouse=True)
def versions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(database, "revisions", lambda program: (KNOWN, {"c3"}))


def steps(path: Path, first: int = 0, last: int = len(STEPS), journal: str = "DELETE") -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as opened:
        opened.execute(f"PRAGMA journal_mode = {journal}")
        for step in STEPS[first:last]:
            opened.execute(step)


def update(path: Path) -> None:
    """The program's migrations: all, or those after the version that a database has."""
    steps(path, {"": 0, "a1": 3, "b2": 5}[database.revision(path)])


def rows(path: Path, table: str) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(path)) as opened:
        return opened.execute(f"SELECT * FROM {table}").fetchall()


def killed(work: Callable[[], None]) -> None:
    """Do the work in a process that ends there without closing anything."""
    child = os.fork()
    if child == 0:
        work()
        os._exit(9)
    os.waitpid(child, 0)


@pytest.mark.parametrize("journal", ["DELETE", "WAL"])
def test_a_kill_while_a_database_is_made_leaves_none_and_the_next_start_makes_it(tmp_path: Path, journal: str):
    path = tmp_path / "x.db"
    for last in range(len(STEPS)):

        def half(made: Path, last: int = last) -> None:
            opened = sqlite3.connect(made, isolation_level=None)  # stays open, with its journal
            opened.execute(f"PRAGMA journal_mode = {journal}")
            for step in STEPS[:last]:
                opened.execute(step)
            opened.execute("BEGIN")
            opened.execute("CREATE TABLE unfinished (x TEXT)")
            os._exit(9)

        killed(lambda half=half: database.ensure(path, "x", half))
        assert not path.exists() and list(tmp_path.iterdir()) != []
        database.ensure(path, "x", update)
        assert [file.name for file in tmp_path.iterdir()] == ["x.db"] and rows(path, "kinds") == [("usual",)]
        path.unlink()


def test_a_whole_database_is_left_alone(tmp_path: Path):
    steps(tmp_path / "x.db")
    database.ensure(tmp_path / "x.db", "x", lambda path: pytest.fail("made again"))


@pytest.mark.parametrize("last", range(len(STEPS)))
def test_what_an_older_version_left_half_made_is_made_again_while_nothing_is_in_it(tmp_path: Path, last: int):
    path = tmp_path / "x.db"
    steps(path, 0, last)
    (tmp_path / "x.db-journal").write_bytes(b"of a file that is gone")
    database.ensure(path, "x", update)
    assert database.revision(path) == "c3" and [file.name for file in tmp_path.iterdir()] == ["x.db"]


@pytest.mark.parametrize(("last", "version"), [(3, "a1"), (5, "b2")])
def test_what_is_in_an_older_database_is_kept_and_so_is_the_old_file(tmp_path: Path, last: int, version: str):
    path = tmp_path / "x.db"
    steps(path, 0, last, "WAL")
    with closing(sqlite3.connect(path)) as opened, opened:
        opened.execute("INSERT INTO runs (name) VALUES ('mine')")
    database.ensure(path, "x", update)
    assert database.revision(path) == "c3" and rows(path, "runs") == [("mine", None)]
    assert rows(tmp_path / f"x.db.{version}", "runs")[0][0] == "mine"


def broken(path: Path, kind: str) -> None:
    """A database that nothing can be made of."""
    if kind == "no database":
        path.write_bytes(b"text" * 1000)
        return
    steps(path, 0, 4)  # half of a step is done, and its version is not noted
    with closing(sqlite3.connect(path)) as opened, opened:
        opened.execute("INSERT INTO runs (name) VALUES ('mine')")
        if kind == "newer":
            opened.execute("UPDATE alembic_version SET version_num = 'd4'")


@pytest.mark.parametrize("kind", ["no database", "half made with runs in it", "newer"])
def test_a_database_that_nothing_can_be_made_of_is_one_line_whose_remedy_works(tmp_path: Path, kind: str):
    path = tmp_path / "my runs" / "x.db"
    path.parent.mkdir()
    broken(path, kind)
    before = path.read_bytes()
    with pytest.raises(BadInput) as caught:
        database.ensure(path, "x", update)
    assert path.read_bytes() == before
    subprocess.run(shlex.split(caught.value.do.partition(",")[0]), check=True)
    database.ensure(path, "x", update)
    assert database.revision(path) == "c3" and (path.parent / "x.db.old").read_bytes() == before


def test_mlflows_own_database_that_was_cut_off_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A stop while MLflow rebuilds a table leaves a half, which MLflow refuses ever after."""
    monkeypatch.undo()
    from mlflow.db import upgrade
    from sqlalchemy import event
    from sqlalchemy.engine import Engine

    def stop(connection: object, cursor: object, statement: str, *_: object) -> None:
        if "CREATE TABLE _alembic_tmp_" in statement:
            raise KeyboardInterrupt

    path = tmp_path / registry.DATABASE
    event.listen(Engine, "after_cursor_execute", stop)
    try:
        with pytest.raises(KeyboardInterrupt):
            upgrade.callback(f"sqlite:///{path}")
    finally:
        event.remove(Engine, "after_cursor_execute", stop)
    with pytest.raises(Exception, match="duplicate column"):
        upgrade.callback(f"sqlite:///{path}")
    registry.ensure_database(tmp_path)
    assert len(rows(path, "alembic_version")) == 1 and rows(path, "runs") == []
    monkeypatch.setattr("mlflow.db.upgrade", None)
    registry.ensure_database(tmp_path)
