"""The browser's pages: what is played, how a push acts, and one line for what cannot be shown."""

import re
import socket
from pathlib import Path

import numpy as np
import pytest

from bumblebee.cli import run
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import write_rollout
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import kinds
from bumblebee.motion.formats.write import write_motion
from bumblebee.robot.facts import joint_names
from bumblebee.view.drawing import GHOST, Drawn, drawing, states
from bumblebee.view.live import LivePolicy
from bumblebee.view.measured import window_entries
from bumblebee.view.page import Page
from bumblebee.view.replay import LARGEST
from bumblebee.view.scene import Picture
from bumblebee.view.server import open_server
from bumblebee.view.shipped import shipped_policy
from bumblebee.view.sources import Entry, found, of_clip
from tests.diagnosis import cart


@pytest.fixture(scope="module")
def clip():
    return make(next(kind for kind in kinds() if kind.name == "squat_quick"), 0, EmbeddedConfig())


@pytest.fixture(scope="module")
def live(clip):
    with shipped_policy() as policy:
        yield LivePolicy(policy, clip)


def off(live: LivePolicy) -> float:
    state = live.qpos()
    return float(np.abs(state[:3] - state[30:33]).max())


def test_the_shipped_policy_follows_its_clip(live: LivePolicy):
    live.seek(0)
    frames = [live.advance() for _ in range(50)]
    assert frames == list(range(1, 51))
    assert off(live) < 0.1


def test_scrubbing_puts_the_robot_onto_the_motion_and_it_goes_on_from_there(live: LivePolicy):
    live.seek(60)
    assert off(live) < 0.03  # soles are put onto the floor
    assert [live.advance() for _ in range(20)][-1] == 80
    assert off(live) < 0.1


def test_a_strong_push_fells_the_robot_and_it_begins_again(live: LivePolicy):
    live.seek(0)
    live.push("left", 4.0)
    said = []
    for _ in range(150):
        frame = live.advance()
        said.append(live.said())
        if frame == 0:
            break
    assert any("fell" in line for line in said)
    assert frame == 0


def test_a_picture_holds_each_robot_s_state_in_turn():
    model = drawing((Drawn("one"), Drawn("two", GHOST)))
    assert model.nq == 60
    assert model.nu == 0
    assert states([np.zeros((3, 2)), np.ones((1, 1))]).tolist() == [[0, 0, 1]] * 3


def test_words_find_entries_by_name_family_and_caption():
    entries = [Entry("walk_fast", "walk", "a person walks"), Entry("bow", "stand", "a person bows")]
    assert found(entries, "PERSON walk") == entries[:1]
    assert found(entries, "") == entries


def test_windows_of_rollouts_are_sorted_by_error_and_begin_at_the_measured_state(tmp_path: Path):
    (tmp_path / "rollouts").mkdir()
    (tmp_path / "model.xml").write_text(cart.xml())
    for rollout in cart.record(friction=(3.0, 0.0)):
        write_rollout(tmp_path / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
    entries = window_entries(tmp_path / "model.xml", tmp_path)
    errors = [float(entry.text.split()[2]) for entry in entries]
    assert errors == sorted(errors, reverse=True)
    source = entries[0].make()
    measured, declared = source.curves["cart"]
    assert abs(measured[0] - declared[0]) < 0.02 < np.abs(measured - declared).max()


def test_the_page_plays_pauses_and_scrubs(clip):
    server = open_server(0)
    try:
        page = Page(Picture(server), [Entry(clip.name, make=lambda: of_clip(clip, joint_names()))], "Motions")
        page.step(0.1)
        assert page._frame == 5
        page._toggle()
        page.step(1.0)
        assert page._frame == 5
        page._time.value = 1.0
        page._scrub()
        page.run(ticks=2)
        assert page._frame == 50
    finally:
        server.stop()


def test_a_taken_port_is_one_line_whose_remedy_works():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(BadInput, match=f"--port {port}: expected a free port"):
            run(["demo", "--view", "--port", str(port)])
        assert run(["demo", "--view", "--port", "0", "--ticks", "2"]) == 0


@pytest.mark.parametrize(
    ("made", "line"),
    [
        ((), "expected a motion"),
        (("rollouts/",), "expected the model of these rollouts, came none. Name its MJCF with --model"),
        (("contract.json",), "contract.json"),
    ],
)
def test_what_cannot_be_shown_is_one_line(tmp_path: Path, made: tuple[str, ...], line: str):
    for name in made:
        (tmp_path / name).mkdir() if name.endswith("/") else (tmp_path / name).write_text("{}")
    with pytest.raises(BadInput, match=line):
        run(["view", str(tmp_path), "--port", "0", "--ticks", "1"])


def test_a_replay_is_one_small_file_that_asks_for_nothing(tmp_path: Path, clip, capsys: pytest.CaptureFixture):
    path = write_motion(tmp_path / "motions", clip, "asap")
    out = tmp_path / "replay.html"
    order = ["view", str(path), "--out", str(out), "--seconds", "0.2"]
    assert run([*order]) == 0
    text = out.read_text()
    assert len(text) < LARGEST
    assert "__VISER_EMBED_DATA__" in text
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=.https?:", text)
    with pytest.raises(BadInput, match="expected a new name"):
        run(order)
    with pytest.raises(BadInput, match="expected something called 'jump'"):
        run([*order[:3], str(tmp_path / "other.html"), "--name", "jump"])
