"""The browser's pages: what is played, how a push acts, and one line for what cannot be shown."""

import re
import shutil
import socket
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from bumblebee.api.policies import load_policy
from bumblebee.cli import run
from bumblebee.errors import BadInput
from bumblebee.learning.trial import World, try_policy
from bumblebee.learning.trial_folder import ENDS, FELL, FOLLOWED, KEY_BODY_OFF, PELVIS_OFF, Kept, ended
from bumblebee.measured.rollout import write_rollout
from bumblebee.motion.clip import clip_states
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import kinds
from bumblebee.motion.formats.write import write_motion
from bumblebee.report.replays.replay import GHOST, LARGEST, Drawn, side_by_side
from bumblebee.robot.facts import joint_names
from bumblebee.sim.sensors import load_model
from bumblebee.view.drawing import drawing
from bumblebee.view.live import LivePolicy
from bumblebee.view.measured import window_entries
from bumblebee.view.page import Page
from bumblebee.view.scene import Picture
from bumblebee.view.server import HOST, address, open_server, stop
from bumblebee.view.shipped import shipped_policy
from bumblebee.view.sources import Entry, found, of_clip
from bumblebee.view.what import evaluation_entries
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
    assert side_by_side([np.zeros((3, 2)), np.ones((1, 1))]).tolist() == [[0, 0, 1]] * 3


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
    assert '<pre class="replays" hidden>' in text
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=.https?:", text)
    with pytest.raises(BadInput, match="expected a new name"):
        run(order)
    with pytest.raises(BadInput, match="expected something called 'jump'"):
        run([*order[:3], str(tmp_path / "other.html"), "--name", "jump"])


@pytest.mark.parametrize("name", ["film.gif", "film.webp"])
def test_a_film_of_what_is_shown_plays_at_real_speed_and_moves(tmp_path: Path, clip, name: str):
    path, out = write_motion(tmp_path / "motions", clip, "asap"), tmp_path / name
    assert run(["view", str(path), "--out", str(out), "--seconds", "0.5"]) == 0
    with Image.open(out) as film:
        shown = []
        for number in range(film.n_frames):
            film.seek(number)
            picture = np.asarray(film.convert("RGB")).astype(int)  # read first: only then a WebP knows its duration
            shown.append((film.info["duration"], picture))
    assert len(shown) == 7 and sum(length for length, _ in shown) == pytest.approx(7 * 80, abs=60)
    assert np.abs(shown[0][1] - shown[-1][1]).max() > 100 and (shown[0][1] < 100).any()


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A motion tried by the shipped policy, and one by a policy that does nothing."""
    out, world = tmp_path_factory.mktemp("evaluation") / "tried", World(load_model(physics_hz=200.0), threads=1)
    kept, shipped = Kept(), load_policy()
    tables = []
    limp = lambda seen: 0 * seen[:, :23]  # noqa: E731
    for policy, name, ahead in ((shipped, "look_left", shipped.shape.ahead), (limp, "walk", ())):
        clip = make(next(kind for kind in kinds() if kind.name == name), 0, EmbeddedConfig())
        tables.append(try_policy(policy, [clip], world, ahead, None, kept.add))
    kept.write(out, pd.concat(tables, ignore_index=True))
    return out


def test_a_rollout_fell_or_its_pelvis_or_a_key_body_was_off(clip):
    robot = clip_states(clip)[1:]
    lost = (False, 0.5)
    assert ended(clip, robot, True, 1.0) == FOLLOWED
    assert ended(clip, robot, *lost) == KEY_BODY_OFF
    assert ended(clip, robot + np.eye(30)[0], *lost) == PELVIS_OFF
    assert ended(clip, robot - 0.5 * np.eye(30)[2], *lost) == FELL


def test_rollouts_of_an_evaluation_are_sorted_by_how_they_were_lost_and_found_by_it(evaluation: Path):
    entries = evaluation_entries(evaluation)
    order = [ENDS.index(entry.group) for entry in entries]
    assert order == sorted(order) and len(set(order)) > 1
    lost = found(entries, entries[0].group)
    assert entries[0] in lost and entries[-1] not in lost
    shown = entries[0].make()
    assert entries[0].group in shown.said()
    assert shown.qpos().shape == (60,)
    np.testing.assert_allclose(shown.qpos()[:3], shown.qpos()[30:33], atol=0.1)  # at the start it is on the motion


def test_the_page_of_an_evaluation_opens_and_its_replay_is_one_file(evaluation: Path, tmp_path: Path):
    assert run(["view", str(evaluation), "--port", "0", "--ticks", "2"]) == 0
    assert run(["view", str(evaluation), "--out", str(tmp_path / "one.html"), "--seconds", "0.2"]) == 0


def test_an_evaluation_without_states_is_one_line_whose_remedy_works(tmp_path: Path):
    loop = tmp_path / "evaluation"
    loop.mkdir()
    (loop / "contract.json").write_text("{}")
    (loop / "episodes.parquet").write_bytes(b"")
    with pytest.raises(BadInput, match=r"evaluation with the robot's states.*evaluate POLICY MOTIONS --states FOLDER"):
        run(["view", str(loop)])
    made = tmp_path / "tried"
    assert run(["evaluate", "shipped", "embedded", "--limit", "1", "--states", str(made)]) == 0
    assert run(["view", str(made), "--port", "0", "--ticks", "1"]) == 0
    with pytest.raises(BadInput, match="a new name"):
        run(["evaluate", "shipped", "embedded", "--limit", "1", "--states", str(made)])


def test_a_damaged_evaluation_is_one_line(evaluation: Path, tmp_path: Path):
    (tmp_path / "trials.csv").write_bytes((evaluation / "trials.csv").read_bytes().replace(b"end,", b"enx,"))
    (tmp_path / "states.parquet").write_bytes((evaluation / "states.parquet").read_bytes()[:-9])
    with pytest.raises(BadInput, match=r"expected trials\.csv and states\.parquet of an evaluation"):
        run(["view", str(tmp_path)])


def test_a_connection_that_asks_for_nothing_leaves_no_traceback(caplog: pytest.LogCaptureFixture):
    server = open_server(0)
    try:
        with socket.create_connection((HOST, server.get_port())) as spare:
            spare.shutdown(socket.SHUT_WR)
            while spare.recv(4096):  # until the server is done with it
                pass
    finally:
        stop(server)
    assert [record for record in caplog.records if record.name.startswith("websockets")] == []


@pytest.mark.slow
def test_in_a_browser_the_page_plays_pauses_scrubs_and_asks_its_own_server_alone(clip):
    sync_api = pytest.importorskip("playwright.sync_api")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if not chromium:
        pytest.skip("no chromium on this machine")
    server = open_server(0)
    page = Page(Picture(server), [Entry(clip.name, make=lambda: of_clip(clip, joint_names()))], "Motions")
    try:
        with sync_api.sync_playwright() as started:
            software = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
            browser = started.chromium.launch(executable_path=chromium, args=software)
            shown, asked = browser.new_page(), []
            shown.on("request", lambda request: asked.append(request.url))
            shown.goto(address(server))

            def until(happened) -> bool:
                """Let the page and the browser run by turns, for a minute at most."""
                rounds = 0
                while not happened() and (rounds := rounds + 1) < 1500:
                    page.run(ticks=4)
                    shown.wait_for_timeout(20)
                return happened()

            button = shown.get_by_role("button", name="Pause")
            assert until(lambda: button.count() > 0)
            assert until(lambda: page._frame > 0)
            button.click()
            assert until(lambda: not page._playing)
            shown.get_by_role("slider").first.press("End")
            assert until(lambda: page._frame == clip.frames - 1)
            assert {url.split("/")[2] for url in asked if "://" in url} == {address(server).split("/")[2]}
            browser.close()
    finally:
        stop(server)
