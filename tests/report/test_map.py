"""The map of the motions: its rows carry what was clustered, and a person can explore it by mouse, touch and keys."""

import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bumblebee.clustering.map import STEP, form, written
from bumblebee.report.charts.motion_map import rows
from bumblebee.report.page import policy, render
from bumblebee.report.sections.clusters_section import clusters_section
from tests.report.made import TRUTH, found, loop_results

NASTY = "<script>document.title='owned'</script>\t\"&\n"
CHROMIUM = next((path for name in ("chromium", "chromium-browser") if (path := shutil.which(name))), "")


def points(count: int = 30) -> pd.DataFrame:
    draw = np.random.default_rng(0)
    names = [f"m{i}" for i in range(count)]
    table = pd.DataFrame({"name": names, "cluster": ["c0", "c1"] * (count // 2), "family": "walk", "licence": "MIT"})
    table["x"], table["y"] = draw.normal(size=count), draw.normal(size=count)
    table["split"], table["seconds"], table["caption_source"] = "train", 4.0, "file"
    table["caption"] = ["a person walks", "a person kicks high"] * (count // 2)
    table["poses"] = written(draw.uniform(0.1, 0.8, (4, 15, 2)))
    table.loc[0, ["name", "caption", "family", "split"]] = [NASTY, NASTY, NASTY, "test"]
    return table


def page(table: pd.DataFrame) -> str:
    made = loop_results([found()], [TRUTH])
    results = replace(made, points=table, clusters={**made.clusters, "map": form()})
    return render("Title", "sub", "", [clusters_section(results)])


def test_a_row_holds_its_values_between_tabs_and_no_name_can_add_one() -> None:
    lines = rows(points(), {"c0": "walk", "c1": "jump"}, form()["signs"]).split("\n")
    cells = [line.split("\t") for line in lines[1:]]
    assert len(cells) == 30 and {len(row) for row in cells} == {11}
    assert cells[1][:2] == ["m1", "c1 jump"] and cells[1][-2:] == ["a person kicks high", points()["poses"][1]]
    across = [int(row[2]) for row in cells]
    assert (min(across), max(across)) == (0, 1000)


def test_the_page_runs_its_own_script_and_nothing_of_the_data() -> None:
    html = page(points())
    (script,) = re.findall(r"<script>(.*?)</script>", html, re.S)
    assert policy(script) in html and "document.title" not in script
    assert "&lt;script&gt;" in html


def test_two_hundred_and_fifty_motions_stay_under_300_kilobytes() -> None:
    table = points(250).assign(caption=160 * "w", licence="CC BY 4.0, G1 Moves, Experiential Technologies")
    html = page(table)
    assert len(re.findall(r"<pre hidden>(.*?)</pre>", html, re.S)[0].encode()) < 150_000
    assert len(html.encode()) < 450_000  # with the style, both pictures and the script


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("map") / "report.html"
    path.write_text(page(points()))
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    sync_api = pytest.importorskip("playwright.sync_api")
    if not CHROMIUM:
        pytest.skip("no chromium on this machine")
    with sync_api.sync_playwright() as driver:
        shown = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield shown
        shown.close()


@pytest.fixture(params=[390, 1440])
def shown(request: pytest.FixtureRequest, browser: Any, file: Path) -> Iterator[Any]:
    opened = browser.new_page(viewport={"width": request.param, "height": 844})
    opened.goto(file.as_uri())
    yield opened
    opened.close()


def test_nothing_is_cut_and_the_plain_picture_gives_way(shown: Any) -> None:
    assert shown.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert shown.title() == "Title" and shown.locator(".plot circle").count() == 31  # one a motion, and the ring
    assert not shown.locator(".map .still").is_visible() and shown.locator(".about b").is_visible()


def test_pointing_at_a_motion_shows_its_name_caption_and_figure(shown: Any) -> None:
    shown.locator(".plot circle").nth(5).click(force=True)
    said = shown.inner_text(".about")
    assert shown.inner_text(".about b") in ("m5", *(f"m{i}" for i in range(30))) and "MIT" in said and "4.0 s" in said
    assert shown.locator(".about svg path").count() == 1 + 4 * 5  # the floor, and five lines a pose


def test_arrow_keys_walk_and_the_search_finds_and_dims(shown: Any) -> None:
    shown.locator(".plot").focus()
    before = float(shown.locator(".plot g circle").get_attribute("cx"))
    shown.keyboard.press("ArrowRight")
    assert float(shown.locator(".plot g circle").get_attribute("cx")) > before
    shown.locator(".map input").fill("kicks")
    assert "kicks high" in shown.inner_text(".about")
    dimmed = "[...document.querySelectorAll('.plot > svg > circle')].filter(e => e.getAttribute('opacity') < 1).length"
    assert shown.evaluate(dimmed) == 15
    first = shown.inner_text(".about b")
    shown.locator(".map input").press("Enter")
    assert shown.inner_text(".about b") != first


def test_the_colours_follow_the_choice_and_held_out_motions_are_open(shown: Any) -> None:
    assert "c0 stand (15)" in shown.inner_text(".legend")
    shown.locator(".map select").select_option("family")
    assert "walk (29)" in shown.inner_text(".legend")
    held = shown.locator(".plot circle").first
    assert held.get_attribute("fill-opacity") == "0"
    assert shown.evaluate("document.querySelectorAll('script').length") == 1


def test_a_pose_is_drawn_where_its_signs_say(browser: Any, tmp_path: Path) -> None:
    """The head, the figure's circle, at 1.2 m, and 0.3 m to the right in the last pose alone."""
    poses = np.zeros((4, 15, 2))
    poses[:, 14, 1], poses[3, 14, 0] = 1.2, 0.3
    path = tmp_path / "report.html"
    path.write_text(page(points().assign(poses=written(poses))))
    opened = browser.new_page()
    opened.goto(path.as_uri())
    heads = (
        "[...document.querySelectorAll('.about svg circle')].map(e => [+e.getAttribute('cx'), +e.getAttribute('cy')])"
    )
    drawn = np.array(opened.evaluate(heads))
    floor = float(re.search(r"M0 ([\d.]+)H", opened.locator(".about svg path").first.get_attribute("d"))[1])
    np.testing.assert_allclose(floor - drawn[:, 1], 1.2, atol=STEP + 0.03)
    np.testing.assert_allclose(np.diff(drawn[:, 0]), [1.15, 1.15, 1.45], atol=STEP)
    opened.close()


def test_without_scripts_the_plain_picture_is_there(browser: Any, file: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    opened = context.new_page()
    opened.goto(file.as_uri())
    assert opened.locator(".map .still img").is_visible() and not opened.locator(".plot").is_visible()
    context.close()
