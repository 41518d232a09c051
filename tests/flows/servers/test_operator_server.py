"""The operator's page shows a run and can stop it, and nothing else; who is not let in sees and stops nothing."""

import asyncio
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout, write_rollout
from bumblebee.view.after_page import after_page
from bumblebee.view.operator_page import STOP_PATH, live_page
from bumblebee.view.operator_process import operator_page
from bumblebee.wire.links import packets
from bumblebee.wire.operator.watcher import Watcher
from flows.people import login
from flows.people.guard import Guard
from flows.servers.operator_server import OperatorPage, Shown
from tests.commands.test_commands import run
from tests.report.test_browser import ARGUMENTS, CHROMIUM, sync_api

FACTS = {
    "records": 1234, "phase": "RUN", "step": "WARN", "tick": 7, "missed": 1, "times": {"wake": [0.1, 0.2, 0.3]},
    "rules": {"soft_zone": 5}, "now": ["soft_zone"], "room_joint": "knee", "torque_joint": "hip", "lean_deg": 3.0,
    "height_m": None, "room_rad": 0.1, "torque": 0.5, "hottest": None,
}  # fmt: skip
HOST = (b"host", b"127.0.0.1:4321")
LOGIN = (b"authorization", login.header("secret").encode())


@pytest.fixture
def both() -> tuple[Watcher, Shown]:
    ours, theirs = packets.pair()
    return Watcher(ours), Shown(theirs)


def status(shown: Shown, method: str, path: str, *headers: tuple[bytes, bytes]) -> int:
    sent: list[dict[str, Any]] = []

    async def send(message: Any) -> None:
        sent.append(message)

    scope = {"type": "http", "method": method, "path": path, "query_string": b"", "headers": headers}
    asyncio.run(Guard(OperatorPage(shown), "secret", True)(scope, None, send))  # type: ignore[arg-type]
    return int(sent[0]["status"])


def test_nothing_but_a_stop_goes_to_the_console_and_only_from_who_is_let_in(both: tuple[Watcher, Shown]) -> None:
    watcher, shown = both
    for method in ("GET", "HEAD", "POST", "PUT", "DELETE"):
        for path in ("/", "/go", "/hold", "/stop/", "/%73top"):
            status(shown, method, path, HOST, LOGIN)
        assert status(shown, method, STOP_PATH, HOST) == 401
        evil = (b"origin", b"http://evil.example")
        assert status(shown, method, STOP_PATH, HOST, LOGIN, evil) == 403
    assert status(shown, "GET", STOP_PATH, HOST, LOGIN) == 404 and not watcher.wants_stop()
    assert status(shown, "POST", STOP_PATH, HOST, LOGIN) == 303
    assert watcher.wants_stop() and not watcher.wants_stop()


def test_the_console_drops_what_nobody_takes_and_forgets_who_is_gone() -> None:
    ours, theirs = packets.pair()
    watcher = Watcher(ours)
    for _ in range(3000):
        watcher.show(FACTS)
    assert watcher.there
    for said in (b"go", b"stopp", b"g", b"stop"):
        packets.send(theirs, said)
    assert [watcher.wants_stop() for _ in range(5)] == [False, False, False, True, False]
    theirs.close()
    assert not watcher.wants_stop()
    watcher.show(FACTS)
    assert not watcher.there and not Watcher().wants_stop()


def test_the_page_shows_the_newest_facts_and_says_when_they_are_old(both: tuple[Watcher, Shown]) -> None:
    watcher, shown = both
    assert "nothing moves" in shown.page()
    watcher.show({"run": {"motion": "<squat>", "seconds": 3.7, "hz": 50.0, "robot": "g1, REAL"}})
    watcher.show({"run": {"sheet": "run sheet: 1 of 2"}})
    for tick in range(3):
        watcher.show(FACTS | {"tick": tick})
    shown.take()
    page = shown.page()
    for words in (
        "&lt;squat&gt;",
        "g1, REAL",
        "run sheet: 1 of 2",
        "0.0 of 3.7 s",
        "soft_zone",
        "1,234",
        "not measured",
    ):
        assert words in page, words
    assert "old. Look at the terminal" not in page and "Look at the terminal" in live_page({}, FACTS, 3.0)


def measured(tmp_path: Path, **more: Any) -> Path:
    wave = np.sin(np.arange(40) / 5)[:, None] * np.ones((1, 8))
    names = tuple(f"j{k}" for k in range(8))
    meta = {"motion": "<nod>", "notes": "ended by tilt", "operator": "ann"}
    path = tmp_path / "set" / "rollouts" / "nod-1.parquet"
    more = {"base_quat": np.tile([1.0, 0, 0, 0], (40, 1)), "joint_target": wave + 0.1, **more}
    write_rollout(path, Rollout("nod-1", names, 50.0, np.arange(40) / 50, wave, wave, meta=meta, **more))
    return path


def test_the_page_after_a_run_shows_what_came_and_commands_that_are_ones(tmp_path: Path) -> None:
    rollout = measured(tmp_path, base_lin_vel=np.zeros((40, 3)))
    assert "bumblebee gate" not in after_page("", {}, 0, rollout, tmp_path / "set", tmp_path)
    (tmp_path / "dvc.yaml").touch()
    page = after_page("tilt", {"tilt": 1}, 2, rollout, tmp_path / "set", tmp_path)
    for words in ("The rule tilt ended it", "40 at 50 Hz, 0.8 s", "&lt;nod&gt;", "ann", "100 mrad RMS"):
        assert words in page, words
    assert page.count("data:image/svg+xml") == 6 and "<script" not in page
    commands = re.findall(r": bumblebee (.*?)</li>", page)
    assert [words.split()[0] for words in commands] == ["gap", "diagnose", "gate"]
    for words in commands:
        assert run(*shlex.split(words), "--help") == 0


def test_the_page_after_a_run_without_odometry_promises_no_diagnosis(tmp_path: Path) -> None:
    page = after_page("", {}, 0, measured(tmp_path), tmp_path, tmp_path)
    assert "Without odometry" in page and "bumblebee diagnose" not in page
    assert "good order" in after_page("", {}, 0, None, tmp_path, tmp_path)


def test_a_page_that_does_not_start_is_one_line_before_anything_moves(tmp_path: Path) -> None:
    (tmp_path / ".servers").write_text("in the way")
    with pytest.raises(BadInput, match=r"--page.*a folder of your own"), operator_page(0, tmp_path, print):
        pass


@pytest.mark.skipif(not CHROMIUM, reason="no chromium on this machine")
def test_in_a_browser_the_page_follows_the_run_stops_it_and_says_when_it_lost_it(tmp_path: Path) -> None:
    said = list[str]()
    with sync_api.sync_playwright() as started, operator_page(0, tmp_path, said.append) as watcher:
        url = said[0].split()[1].rstrip(",")
        password = str(login.read(tmp_path / ".servers"))
        watcher.show(FACTS)
        browser = started.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        known = browser.new_context(
            http_credentials={"username": login.USER, "password": password}, viewport={"width": 390, "height": 844}
        )
        shown = known.new_page()
        shown.goto(url)
        watcher.show(FACTS | {"tick": 99})
        shown.wait_for_selector("text=tick 99")
        assert shown.evaluate("document.documentElement.scrollWidth <= innerWidth")
        box = shown.locator(".halt").bounding_box()
        assert box["y"] + box["height"] < 844
        with shown.expect_navigation(url=re.compile("/$")):
            shown.click(".halt")
        assert watcher.wants_stop()
        shown.wait_for_selector("text=tick 99")
        watcher._end.close()  # type: ignore[union-attr]  # the console is gone
        shown.wait_for_selector("text=This page lost the run")
        browser.close()
