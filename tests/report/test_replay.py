"""3D replays of a page: what they hold, how they are kept small, and that they play without a network."""

import base64
import json
import re
import shutil
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from bumblebee.clustering.map import form
from bumblebee.report.page import render
from bumblebee.report.replays import replay_page
from bumblebee.report.replays.replay import GHOST, Drawn, Part, Take, part, side_by_side
from bumblebee.report.replays.replay_still import panel
from bumblebee.report.replays.shape import coarse, shape, surfaces
from bumblebee.report.replays.windows import SeenWindow, window_takes
from bumblebee.report.sections.clusters_section import clusters_section
from bumblebee.robot.model import build_spec
from tests.diagnosis import cart
from tests.report.made import TRUTH, found, loop_results
from tests.report.test_map import points

CHROMIUM = next((path for name in ("chromium", "chromium-browser") if (path := shutil.which(name))), "")
SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
ROBOT = """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 1"><freejoint/><geom type="box" size=".2 .1 .1" rgba=".9 .2 .1 1"/>
<body pos=".3 0 .1" quat=".9 .1 .3 .2"><joint type="hinge" axis="1 2 0" pos="-.1 .02 .03" ref=".2"/>
<geom type="capsule" size=".05 .2"/>
<body pos="0 .1 .3"><joint type="slide" axis="0 .6 .8"/><joint type="ball" pos=".05 0 0"/>
<geom type="cylinder" size=".05 .1"/></body></body></body></worldbody></mujoco>"""


def spec() -> mujoco.MjSpec:
    return mujoco.MjSpec.from_string(ROBOT)


def take(name: str = "one", frames: int = 51, fps: float = 50.0, group: str = "motions", seed: int = 0) -> Take:
    drawn, draw = shape(spec()), np.random.default_rng(seed)
    states = np.cumsum(draw.normal(scale=0.02, size=(frames, drawn.model.nq)), axis=0)
    states[:, 2] += 1.0
    for quat in (states[:, 3:7], states[:, 9:13]):
        quat[:, 0] += 1.0
        quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    return Take(name, group, states, fps, (Drawn("robot"),), drawn)


def test_a_simulation_that_diverged_has_no_number() -> None:
    seen = SeenWindow("r0", (np.nan, 0.001), np.zeros((1, 3)), np.zeros((3, 1, 1)), 50.0)
    assert seen.text == "declared model diverged, corrected model 1.0 mrad off"


def unpacked(made: Part) -> dict[str, Any]:
    return json.loads(zlib.decompress(base64.b64decode(made.data)))


def states_of(entry: dict[str, Any]) -> np.ndarray:
    """States as the page reads them."""
    changes = np.frombuffer(base64.b64decode(entry["states"]), "<u2").reshape(-1, entry["frames"])
    made = np.tile(entry["low"], (entry["frames"], 1))
    moves = np.array(entry["step"]) > 0
    made[:, moves] += (np.cumsum(changes, axis=1).astype("<u2") * np.array(entry["step"])[moves, None]).T
    return made


def test_states_come_back_and_a_robot_of_several_replays_is_kept_once() -> None:
    one, two = take("one"), take("two", seed=1)
    document = unpacked(part([one, two]))
    assert len(document["shapes"]) == 1
    for entry, given in zip(document["takes"], (one, two), strict=True):
        np.testing.assert_allclose(states_of(entry), given.states, atol=1e-4)


def test_a_quaternion_that_changes_its_sign_is_the_same_rotation_without_a_jump() -> None:
    given = take()
    given.states[20:, 3:7] *= -1
    steps = np.abs(np.diff(states_of(unpacked(part([given]))["takes"][0])[:, 3:7], axis=0))
    assert steps.max() < 0.2


def test_too_many_replays_lose_frames_first_then_the_last_ones_and_the_page_says_so() -> None:
    takes = [take(f"m{i}", 400, 50.0, seed=i) for i in range(6)]
    whole = part(takes)
    assert (whole.note, len(whole.names)) == ("", 6)
    thinner = part(takes, len(whole.data) * 2 // 3)
    assert {entry["fps"] for entry in unpacked(thinner)["takes"]} == {25.0}
    assert (thinner.note, len(thinner.names)) == ("For size, replays show 25 frames a second.", 6)
    fewer = part(takes, len(whole.data) // 3)
    assert len(fewer.data) <= len(whole.data) // 3
    assert 0 < len(fewer.names) < 6 and fewer.names[0] == ("motions", "m0")
    assert fewer.note.endswith(f"{6 - len(fewer.names)} are left out.")


def test_shorter_robots_stand_still_at_their_last_state() -> None:
    assert side_by_side([np.zeros((3, 2)), np.ones((1, 1))]).tolist() == [[0, 0, 1]] * 3


def test_a_robot_without_geoms_is_drawn_as_rods_between_its_bodies() -> None:
    arm = "<body><joint/><inertial pos='0 0 .1' mass='1' diaginertia='1 1 1'/>{}</body>"
    parts = surfaces(
        mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{arm.format(arm.format(''))}</worldbody></mujoco>")
    )
    assert [part.body for part in parts] == [1, 2]
    apart = arm.replace("<body>", "<body pos='0 0 .3'>")
    parts = surfaces(
        mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{arm.format(apart.format(''))}</worldbody></mujoco>")
    )
    assert np.ptp(parts[-1].points[:, 2]) == pytest.approx(0.3)


def test_large_meshes_are_made_coarser_and_keep_their_extent(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = surfaces(spec().compile())
    monkeypatch.setattr("bumblebee.report.replays.shape._MOST_BYTES", 2000)
    small = coarse(parts)
    assert sum(6 * len(p.points) + 12 * len(p.faces) for p in small) <= 2000
    for before, after in zip(parts, small, strict=True):
        if len(after.points):
            assert np.abs(np.ptp(before.points, axis=0) - np.ptp(after.points, axis=0)).max() < 0.1


def test_the_g1_of_all_replays_together_with_its_player_is_small() -> None:
    drawn = shape(build_spec())
    states = np.zeros((100, 30))
    states[:, 3] = 1
    assert len(part([Take("g1", "motions", states, 50.0, (Drawn("motion"),), drawn)]).data) < 60_000
    assert len(replay_page.script()) < 25_000


def test_the_picture_without_webgl_shows_the_robot_in_its_colours_and_the_ghost_paler() -> None:
    given = take()
    plain = panel(given, 0).reshape(-1, 3).astype(int)
    assert ((plain[:, 0] > 100) & (plain[:, 1] < 90)).any()  # the red box
    both = Take(
        "b", "g", side_by_side([given.states, given.states]), 50.0, (Drawn("a"), Drawn("b", GHOST)), given.shape
    )
    assert panel(both, 0).reshape(-1, 3)[:, 2].astype(int).mean() != plain[:, 2].mean()


def test_windows_are_the_worst_and_the_median_of_the_model() -> None:
    takes = window_takes(cart.session(cart.record(friction=(3.0, 0.0))))
    assert [t.name for t in takes] == ["worst window of the declared model", "median window of the declared model"]
    worst, median = (float(re.findall(r"([\d.]+) mrad", t.note)[0]) for t in takes)
    assert worst > median
    assert [robot.name for robot in takes[0].robots] == ["measured", "declared"]


@pytest.fixture(scope="module")
def started() -> Iterator[Any]:
    sync_api = pytest.importorskip("playwright.sync_api")
    if not CHROMIUM:
        pytest.skip("no chromium on this machine")
    with sync_api.sync_playwright() as made:
        yield made


@pytest.fixture(scope="module")
def browser(started: Any) -> Iterator[Any]:
    opened = started.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("replay") / "replay.html"
    path.write_text(replay_page.replay_page(one := take("<b>one</b>"), part([one])))
    return path


def test_the_page_places_bodies_where_mujoco_does(browser: Any) -> None:
    source = re.search(r"(const turn = .*?)\n  for \(const shape of shapes\)", replay_page.script(), re.S)
    assert source
    given = take(frames=2)
    body = "shape.of = shape.bodies.map((_, b) => shape.joints.filter((joint) => joint[0] === b));"
    code = f"([shape, q]) => {{ {source[1]}\n {body} return poses(shape, q); }}"
    shown = browser.new_page()
    places, quats = shown.evaluate(code, [given.shape.data, given.states[1].tolist()])
    shown.close()
    data = mujoco.MjData(given.shape.model)
    data.qpos[:] = given.states[1]
    mujoco.mj_kinematics(given.shape.model, data)
    np.testing.assert_allclose(places, data.xpos, atol=1e-5)
    np.testing.assert_allclose(np.abs(np.sum(np.array(quats) * data.xquat, axis=1)), 1.0, atol=1e-5)


def test_a_replay_plays_at_a_chosen_speed_pauses_and_scrubs_with_the_network_cut(browser: Any, file: Path) -> None:
    context = browser.new_context(offline=True)
    shown = context.new_page()
    asked: list[str] = []
    shown.on("request", lambda request: asked.append(request.url))
    shown.goto(file.as_uri())
    figure = shown.locator("figure.replay[data-drawn]")
    figure.wait_for(timeout=60_000)
    slider, clock, play = shown.locator("input[type=range]"), shown.locator("output"), shown.locator(".play")
    assert figure.get_attribute("data-state") == "playing"  # by itself
    shown.locator(".speed").select_option("0.1")
    slider.fill("0")
    play.click()
    slow = "() => +document.querySelector('input[type=range]').value"
    while not (at := shown.evaluate(slow)):
        pass
    assert at <= 25  # 5 s of the wall clock at a tenth of the speed
    play.click()
    assert figure.get_attribute("data-state") == "paused"
    pictures = []
    for frame in ("5", "45"):
        slider.fill(frame)
        pictures.append(shown.locator("canvas").screenshot())
    assert pictures[0] != pictures[1]
    assert clock.inner_text() == "0.90 of 1.00 s"
    assert not shown.locator(".still").is_visible()
    assert [url for url in asked if not url.startswith("data:")] == [file.as_uri()]
    assert shown.title() == "<b>one</b>"
    context.close()


CONTRAST = """(e) => {
    const light = (colour) => { const c = colour.match(/[\\d.]+/g).slice(0, 3)
        .map(Number).map((v) => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
        return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2] + 0.05; };
    const clear = (colour) => /, 0\\)$/.test(colour);
    let under = e; while (under && clear(getComputedStyle(under).backgroundColor)) under = under.parentElement;
    const pair = [light(getComputedStyle(e).color), under ? light(getComputedStyle(under).backgroundColor) : 1.05];
    return Math.max(...pair) / Math.min(...pair);
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
def test_a_replay_fits_the_screen_can_be_read_and_is_driven_with_the_network_cut(
    browser: Any, file: Path, width: int, scheme: str
) -> None:
    context = browser.new_context(offline=True, viewport={"width": width, "height": 900}, color_scheme=scheme)
    shown = context.new_page()
    shown.goto(file.as_uri())
    shown.locator("figure.replay[data-drawn]").wait_for(timeout=60_000)
    assert shown.evaluate("document.documentElement.scrollWidth <= innerWidth")
    for part_of_it in ("canvas", ".play", "input[type=range]", "output", ".speed"):
        box = shown.locator(part_of_it).bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= width, part_of_it
    for words in ("h1", "output", ".play"):
        assert shown.locator(words).first.evaluate(CONTRAST) > 4.5, words
    shown.locator(".play").click()
    slider, pictures = shown.locator("input[type=range]"), []
    for frame in ("5", "45"):
        slider.fill(frame)
        pictures.append(shown.locator("canvas").screenshot())
    assert pictures[0] != pictures[1]
    shown.locator(".play").click()
    pytest.importorskip("playwright.sync_api").expect(slider).not_to_have_value("45")
    context.close()


def test_without_scripts_the_picture_is_shown_and_no_dead_button(browser: Any, file: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    shown = context.new_page()
    shown.goto(file.as_uri())
    assert shown.locator(".still img").is_visible() and not shown.locator(".play").is_visible()
    context.close()


def test_without_webgl_the_picture_is_shown_and_no_dead_button(started: Any, file: Path) -> None:
    opened = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-3d-apis"])
    shown = opened.new_page()
    shown.goto(file.as_uri())
    assert shown.evaluate("document.createElement('canvas').getContext('webgl2')") is None
    assert shown.locator(".still img").is_visible() and not shown.locator(".play").is_visible()
    opened.close()


def test_pointing_at_a_motion_of_the_map_plays_it_and_one_without_a_replay_has_its_figures(
    browser: Any, tmp_path: Path
) -> None:
    takes = [take("m3"), take("m4", seed=1)]
    made, players = part(takes), {"motions": str(replay_page.player(takes[0], "Motion in 3D"))}
    results = loop_results([found()], [TRUTH])
    results = replace(results, points=points(), clusters={**results.clusters, "map": form()}, players=players)
    path = tmp_path / "report.html"
    path.write_text(render("Title", "sub", "", [clusters_section(results)], None, made))
    shown = browser.new_page(viewport={"width": 1440, "height": 900})
    shown.goto(path.as_uri())
    shown.locator("figure.replay[data-drawn]").wait_for(state="attached", timeout=60_000)
    search, menu = shown.locator("input[type=search]"), shown.locator(".takes")
    search.fill("m4")
    assert shown.locator(".replay canvas").is_visible() and not shown.locator(".poses").is_visible()
    assert menu.locator("option:checked").inner_text() == "m4"
    search.fill("m5")
    assert not shown.locator(".replay canvas").is_visible() and shown.locator(".poses").is_visible()
    shown.close()
