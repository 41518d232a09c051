"""Two people at a gate, groups, and the record of all answers, which nobody changes in silence."""

import grp
import json
import os
import pwd
import shlex
import subprocess
from pathlib import Path
from typing import Any

import pytest

from bumblebee.errors import BadInput
from tasks.approvals import gate, ledger, words
from tasks.approvals.people import approvers, members

PAGE = gate.Author("Ann", {"how": "Prefect's page"})
TWO = gate.GateConfig(people=2)


def person(login: str) -> gate.Author:
    return gate.Author(login.title(), {"how": "unix user", "user": login, "uid": 1000, "host": "lab"})


@pytest.fixture
def place(tmp_path: Path) -> gate.Gate:
    made = gate.Gate(tmp_path, 1)
    write(made, 4)
    return made


def write(place: gate.Gate, accepted: int) -> None:
    place.summary.parent.mkdir(parents=True, exist_ok=True)
    counts = {"accepted": accepted, "quarantined": 1, "seconds": 8.0, "by_rule": {}}
    place.summary.write_text(json.dumps(counts))


def answer(place: gate.Gate, login: str, approve: bool = True, **more: Any) -> dict[str, Any]:
    seen = gate.request(place, people=2)["seen"]["sha256"]
    return gate.answer(place, approve, person(login), seen, rule=TWO, **more)


def test_one_approval_of_two_lets_nothing_pass_and_says_who_is_missing(place: gate.Gate) -> None:
    table = answer(place, "ann")
    assert table["status"] == "pending" and gate.verdict(place, people=2) == "pending"
    assert gate.settle(place, False, 2) == table
    assert "approved by Ann (unix user ann, uid 1000, on lab), 1 of 2 people" in words.how_to_answer(
        place.workspace, table
    )
    table = answer(place, "bob", note="both looked")
    assert table["status"] == "approved" and approvers(table) == ["ann", "bob"]
    assert words.said(table).startswith("approved by Ann (unix user ann, uid 1000, on lab) and Bob (")
    assert gate.verdict(place, people=2) == gate.settle(place, False, 2)["status"] == "approved"


def test_nobody_approves_twice_and_one_rejection_ends_it(place: gate.Gate) -> None:
    answer(place, "ann")
    with pytest.raises(BadInput, match="round 1: expected approvals by 2 people, came a second one by ann"):
        answer(place, "ann")
    assert answer(place, "bob", approve=False, note="slipped")["status"] == "rejected"
    assert gate.verdict(place, people=2) == "rejected"
    assert answer(place, "bob", change=True)["status"] == "pending"  # a change of mind needs the other one again


def test_approvals_of_other_data_do_not_count(place: gate.Gate) -> None:
    answer(place, "ann")
    write(place, 5)
    assert answer(place, "bob")["status"] == "pending"
    assert answer(place, "ann")["status"] == "approved"


def test_where_two_must_an_answer_by_one_from_before_does_not_stand(place: gate.Gate) -> None:
    seen = gate.request(place)["seen"]["sha256"]
    gate.answer(place, True, person("ann"), seen)
    assert (gate.verdict(place), gate.verdict(place, people=2)) == ("approved", "pending")
    asked = gate.request(place, people=2)
    assert asked["status"] == "pending" and asked["history"][-1]["by"] == "Ann"


def test_who_is_known_by_a_shared_login_alone_cannot_answer_for_two_or_for_a_group(place: gate.Gate) -> None:
    seen = gate.request(place)["seen"]["sha256"]
    for rule in (TWO, gate.GateConfig(group=grp.getgrgid(os.getgid()).gr_name)):
        with pytest.raises(BadInput, match=r"a login of their own.*bumblebee gate approve"):
            gate.answer(place, True, PAGE, seen, rule=rule)
    assert gate.answer(place, True, PAGE, seen)["status"] == "approved"


def test_only_the_groups_members_answer(place: gate.Gate) -> None:
    own = grp.getgrgid(os.getgid()).gr_name
    me = gate.unix_user("Me")
    seen, rule = gate.request(place)["seen"]["sha256"], gate.GateConfig(group=own)
    assert me.known_by["user"] in members(own)
    with pytest.raises(BadInput, match=f"expected a member of the group {own}.*came nobody-at-all"):
        gate.answer(place, True, person("nobody-at-all"), seen, rule=rule)
    assert gate.answer(place, True, me, seen, rule=rule)["status"] == "approved"
    with pytest.raises(BadInput, match=r"gate\.group: expected a group of this machine"):
        members("no-such-group-here")


def test_gates_that_answer_themselves_ask_nobody() -> None:
    with pytest.raises(BadInput, match="mode"):
        gate.GateConfig(mode="auto", people=2)
    with pytest.raises(BadInput, match="people"):
        gate.GateConfig(people=0)


def test_the_record_has_every_answer_with_what_was_seen_and_shows_what_was_changed(place: gate.Gate) -> None:
    answer(place, "ann")
    answer(place, "bob", approve=False, note="slipped")
    write(place, 5)
    gate.settle(place, True)
    folder = place.approval.parent
    found = [entry["answer"] for entry in ledger.check(folder)]
    assert [(one["status"], one["by"].split()[0]) for one in found] == [
        ("approved", "Ann"), ("rejected", "Bob"), ("approved", "automatic"),
    ]  # fmt: skip
    assert found[0]["seen"] == found[1]["seen"] != found[2]["seen"]
    file = folder / ledger.NAME
    lines = file.read_text().splitlines(keepends=True)
    for broken in (lines[1:], [lines[0], lines[2]], [lines[0].replace("Ann", "Eve"), *lines[1:]], [*lines, "{}\n"]):
        file.write_text("".join(broken))
        with pytest.raises(BadInput, match=r"record\.jsonl, line \d: expected what was written"):
            ledger.check(folder)
    file.write_text("".join(lines) + lines[0][:40])  # a kill within a line
    assert len(ledger.check(folder)) == 3 and file.read_text() == "".join(lines)


@pytest.mark.parametrize("cut", [1, 2, 3])
def test_a_record_whose_end_was_cut_is_named_also_with_the_old_request_put_back(place: gate.Gate, cut: int) -> None:
    gate.request(place)
    file, old = place.approval.parent / ledger.NAME, place.approval.read_text()
    for number in range(3):
        answer(place, "ann", approve=number == 1, change=True)
    lines = file.read_text().splitlines(keepends=True)
    file.write_text("".join(lines[:-cut]))
    place.approval.write_text(old)
    before = file.read_bytes()
    with pytest.raises(BadInput, match="expected the last answer that was given"):
        ledger.check(file.parent)
    with pytest.raises(BadInput, match="expected the last answer that was given") as caught:
        answer(place, "bob")
    assert place.approval.read_text() == old and file.read_bytes() == before
    subprocess.run(shlex.split(caught.value.do.partition("on purpose: ")[2]), check=True)
    answer(place, "bob")
    assert len(ledger.check(file.parent)) == 1
    file.unlink()
    with pytest.raises(BadInput, match="0 answers without it"):
        ledger.check(file.parent)


def test_where_no_answer_was_given_a_record_is_believed_as_far_as_it_goes(place: gate.Gate) -> None:
    """As in a copy of the workspace without its private folder."""
    answer(place, "ann")
    (place.workspace / ".servers").rename(place.workspace / "elsewhere")
    assert not ledger.end_known(place.approval.parent) and len(ledger.check(place.approval.parent)) == 1
    answer(place, "bob")
    assert ledger.end_known(place.approval.parent)


def test_a_broken_record_takes_no_answer(place: gate.Gate) -> None:
    answer(place, "ann")
    file = place.approval.parent / ledger.NAME
    file.write_text(file.read_text().replace("Ann", "Eve"))
    before = place.approval.read_text()
    with pytest.raises(BadInput, match="line 1"):
        answer(place, "bob")
    assert place.approval.read_text() == before


def test_a_personal_login_answers_for_two_and_is_the_same_person_as_a_unix_user_of_its_name(place: gate.Gate) -> None:
    seen = gate.request(place)["seen"]["sha256"]
    page = gate.Author("Ann", gate.personal("ann", ("robotics",)))
    terminal = gate.Author("ann", {"how": "unix user", "user": "ann", "uid": 7, "host": "lab"})
    gate.answer(place, True, page, seen, rule=TWO)
    with pytest.raises(BadInput, match="a second one by ann"):
        gate.answer(place, True, terminal, seen, rule=TWO)
    table = gate.answer(place, True, gate.Author("Bob", gate.personal("bob", ())), seen, rule=TWO)
    assert table["status"] == "approved" and gate.verdict(place, people=2) == "approved"
    assert "Ann (personal login ann) and Bob (personal login bob)" in words.said(table)


def test_of_personal_logins_the_groups_of_their_list_count_and_no_unix_group(place: gate.Gate) -> None:
    seen, own = gate.request(place)["seen"]["sha256"], grp.getgrgid(os.getgid()).gr_name
    rule = gate.GateConfig(group=own)
    stranger = gate.Author("me", gate.personal(pwd.getpwuid(os.getuid()).pw_name, ("robotics",)))
    with pytest.raises(BadInput, match=f"a member of the group {own}"):
        gate.answer(place, True, stranger, seen, rule=rule)
    member = gate.Author("Ann", gate.personal("ann", (own,)))
    assert gate.answer(place, True, member, seen, rule=rule)["status"] == "approved"
