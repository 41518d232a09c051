"""The list of people: passwords known to nobody, names that wait after wrong ones, and who is removed is out."""

import asyncio
import json
import stat
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from flows.people import accounts as people
from flows.people import login
from flows.people.accounts import WAIT, WRONG, Busy, People, Person


class Clock:
    """Seconds that a test lets pass."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def who(listed: People, name: str, password: str) -> Person | None:
    return asyncio.run(listed.person(f"{name}:{password}"))


def test_a_password_is_right_for_its_name_alone_and_stands_nowhere(tmp_path: Path) -> None:
    ann, bob = people.add(tmp_path, "ann", ("leads",)), people.add(tmp_path, "bob", ())
    assert ann != bob and len(ann) >= 32
    listed = People(tmp_path)
    for _ in range(2):  # the second time without scrypt
        found = who(listed, "ann", ann)
        assert found is not None and (found.name, found.groups) == ("ann", ("leads",))
    assert who(listed, "ann", bob) is None and who(listed, "bob", ann) is None and who(listed, "", "") is None
    text = (tmp_path / people.FILE).read_text()
    assert ann not in text and bob not in text
    assert stat.S_IMODE((tmp_path / people.FILE).stat().st_mode) == 0o600
    salts = [one["salt"] for one in json.loads(text)["people"]]
    assert len(set(salts)) == 2


def test_who_is_removed_or_gets_another_password_is_out_at_once(tmp_path: Path) -> None:
    first = people.add(tmp_path, "ann", ())
    listed = People(tmp_path)
    assert who(listed, "ann", first) is not None
    people.remove(tmp_path, "ann")
    assert who(listed, "ann", first) is None
    second = people.add(tmp_path, "ann", ("leads",))
    assert who(listed, "ann", first) is None and who(listed, "ann", second) is not None


def test_after_a_few_wrong_passwords_a_name_waits_but_not_who_is_in_and_no_other(tmp_path: Path) -> None:
    ann, bob = people.add(tmp_path, "ann", ()), people.add(tmp_path, "bob", ())
    clock = Clock()
    listed = People(tmp_path, clock)
    assert who(listed, "bob", bob) is not None
    for name in ("ann", "bob", "nobody"):
        for _ in range(WRONG):
            assert who(listed, name, "guess") is None
        with pytest.raises(Busy):
            who(listed, name, "guess")
    with pytest.raises(Busy):
        who(listed, "ann", ann)
    assert who(listed, "bob", bob) is not None, "he was in before"
    clock.now = WAIT
    assert who(listed, "ann", ann) is not None


def test_guesses_that_come_at_once_are_counted_each(tmp_path: Path) -> None:
    people.add(tmp_path, "ann", ())
    listed = People(tmp_path, Clock())

    async def many() -> list[object]:
        return await asyncio.gather(*(listed.person(f"ann:{n}") for n in range(20)), return_exceptions=True)

    found = asyncio.run(many())
    assert found.count(None) == WRONG and sum(isinstance(one, Busy) for one in found) == 20 - WRONG


@pytest.mark.parametrize("name", ["", "Ann", "ann smith", "ann:x", "../x", "a" * 33, login.USER, "1st"])
def test_a_name_that_could_be_taken_for_something_else_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInput, match="the name"):
        people.add(tmp_path, name, ())
    assert people.read(tmp_path) == {}


def test_a_name_is_given_once_and_a_stranger_cannot_be_removed(tmp_path: Path) -> None:
    people.add(tmp_path, "ann", ())
    with pytest.raises(BadInput, match="ann, which is there"):
        people.add(tmp_path, "ann", ())
    with pytest.raises(BadInput, match="expected ann, came bob"):
        people.remove(tmp_path, "bob")
    with pytest.raises(BadInput, match="--group"):
        people.add(tmp_path, "bob", ("Leads!",))


@pytest.mark.parametrize("spoil", ["readable", "link", "no json", "another file", "short"])
def test_a_list_that_others_could_have_written_lets_nobody_in(tmp_path: Path, spoil: str) -> None:
    password, path = people.add(tmp_path, "ann", ()), tmp_path / people.FILE
    if spoil == "readable":
        path.chmod(0o644)
    elif spoil == "link":
        path.rename(tmp_path / "other")
        path.symlink_to(tmp_path / "other")
    else:
        known = {"no json": "{", "another file": "[]"}
        path.write_text(
            known.get(spoil, json.dumps({"people": [{"name": "ann", "groups": [], "salt": "", "hash": ""}]}))
        )
    with pytest.raises(BadInput, match=r"people\.json"):
        people.read(tmp_path)
    assert who(People(tmp_path), "ann", password) is None
