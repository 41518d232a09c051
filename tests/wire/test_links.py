"""Wires: all who listen on a channel get what is sent on it, in order, and nobody else."""

import importlib.util
import os
import stat
import sys
import uuid
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.wire.links.link import Link, open_link
from bumblebee.wire.messages import CARD, ORDER, STATE


def lcm_here() -> bool:
    try:
        import lcm

        lcm.LCM("udpm://239.255.76.67:7667?ttl=0")
    except (ImportError, RuntimeError):
        return False
    return True


def dds_here() -> bool:
    return importlib.util.find_spec("cyclonedds") is not None


WIRES = ["sim", pytest.param("lcm", marks=pytest.mark.skipif(not lcm_here(), reason="no lcm, or no multicast here"))]


def address(wire: str, tmp_path: Path) -> str:
    """One of its own for each test."""
    if wire == "unitree":
        return f"dds://127.0.0.1?domain={1 + uuid.uuid4().int % 200}&kp=40&kd=1"
    return str(tmp_path / "w") if wire == "sim" else f"udpm://239.255.76.67:{20000 + uuid.uuid4().int % 40000}?ttl=0"


def heard(link: Link, count: int) -> list[tuple[str, bytes]]:
    found = link.received()
    while len(found) < count:
        link.wait(5.0)
        new = link.received()
        assert new, f"only {found} came"
        found += new
    return found


@pytest.mark.parametrize("wire", WIRES)
def test_a_message_reaches_everyone_who_listens_on_its_channel_in_order(wire: str, tmp_path: Path) -> None:
    at = address(wire, tmp_path)
    listeners = [open_link(wire, [STATE, CARD], at), open_link(wire, [STATE], at), open_link(wire, [ORDER], at)]
    robot = open_link(wire, [ORDER], at)
    robot.send(CARD, b"card")
    for k in range(5):
        robot.send(STATE, bytes([k]) * 1300)
    states = [(STATE, bytes([k]) * 1300) for k in range(5)]
    assert heard(listeners[0], 6) == [(CARD, b"card"), *states]
    assert heard(listeners[1], 5) == states
    listeners[0].send(ORDER, b"order")
    assert heard(robot, 1) == [(ORDER, b"order")] and heard(listeners[2], 1) == [(ORDER, b"order")]
    assert listeners[2].received() == []
    for link in (*listeners, robot):
        link.close()


def test_a_listener_that_was_killed_leaves_nothing_behind(tmp_path: Path) -> None:
    one, other = open_link("sim", [STATE], str(tmp_path / "w")), open_link("sim", [ORDER], str(tmp_path / "w"))
    one._socket.close()  # type: ignore[attr-defined]  # as the kernel does
    other.send(STATE, b"x")
    assert len(os.listdir(tmp_path / "w")) == 1
    other.close()
    assert os.listdir(tmp_path / "w") == [] and stat.S_IMODE((tmp_path / "w").stat().st_mode) == 0o700


def test_files_that_are_no_sockets_are_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "w"
    robot = open_link("sim", [STATE], str(folder))
    (folder / "CONTRACT-1.pdf").write_text("ours")
    robot.send(ORDER, b"order")
    robot.close()
    assert (folder / "CONTRACT-1.pdf").read_text() == "ours"


def test_wires_that_cannot_be_opened_are_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "open").mkdir(mode=0o755)
    (tmp_path / "file").write_text("")
    monkeypatch.setitem(sys.modules, "lcm", None)
    for wire, at, word in (
        ("sim", tmp_path / "open", "chmod 700"),
        ("sim", tmp_path / "file", "folder for sockets"),
        ("sim", tmp_path / ("x" * 120), "shorter"),
        ("lcm", "", "pip install -e .*wire"),
        ("can", "", "sim or lcm"),
    ):
        with pytest.raises(BadInput, match=word):
            open_link(wire, [STATE], str(at))
    (tmp_path / "open").chmod(0o700)  # the remedy
    open_link("sim", [STATE], str(tmp_path / "open")).close()
