"""The page in a browser: nothing cut on a phone, letters that can be read, no request, a film that can be driven."""

import base64
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bumblebee.report.films.filmstrip import sheet
from bumblebee.report.page import Section, film, heading
from tests.report.made import TRUTH, found, page, page_of, won_back

sync_api = pytest.importorskip("playwright.sync_api")
CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), ""
)
pytestmark = pytest.mark.skipif(not CHROMIUM, reason="no chromium on this machine")
ARGUMENTS = ["--no-sandbox", "--disable-background-networking"]
NASTY = '<script>document.title="owned"</script>"\'><img src=https://example.org/x onerror=alert(1)> $x_{$'
SMALLEST = 11.0  # CSS pixels on the screen


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    frames = np.zeros((12, 30, 32, 3), np.uint8)
    frames[:] = np.arange(12)[:, None, None, None] * 20
    shown = Section("film", "Film", (film(sheet(frames, 10.0), f"Film of {NASTY}", "At real speed.", "A robot"),))
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(page([found()], [TRUTH], [shown], name=NASTY, note=NASTY))
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with sync_api.sync_playwright() as started:
        opened = started.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


@pytest.fixture
def phone(browser: Any, file: Path) -> Iterator[Any]:
    shown = browser.new_page(viewport={"width": 390, "height": 844})
    shown.asked = []
    shown.on("request", lambda request: shown.asked.append(request.url))
    shown.goto(file.as_uri())
    yield shown
    shown.close()


def test_nothing_is_cut_on_a_phone_or_scrolls_sideways_but_tables(phone: Any) -> None:
    assert phone.evaluate("document.documentElement.scrollWidth <= innerWidth")
    cut = """() => [...document.querySelectorAll('body *')].filter(e => {
        if (e.closest('.scroll, .screen') || e.closest('.scroll')) return false;
        const box = e.getBoundingClientRect();
        return box.width && (box.right > innerWidth + 1 || box.left < -1);
    }).map(e => e.outerHTML.slice(0, 80))"""
    assert phone.evaluate(cut) == []


def test_no_letter_is_too_small_on_a_phone(phone: Any) -> None:
    small = f"""() => {{
        const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
        while (walker.nextNode()) {{
            const e = walker.currentNode.parentElement;
            if (!walker.currentNode.data.trim() || !e.getClientRects().length || e.closest('script')) continue;
            if (parseFloat(getComputedStyle(e).fontSize) < {SMALLEST}) found.push(walker.currentNode.data);
        }}
        return found;
    }}"""
    assert phone.evaluate(small) == []
    figures = phone.evaluate("[...document.querySelectorAll('figure img')].map(e => [e.src, e.clientWidth])")
    sizes = [size for uri, width in figures if "svg" in uri[:30] for size in letters(uri, width)]
    assert len(sizes) > 20
    assert min(sizes) >= SMALLEST


def letters(uri: str, width: float) -> list[float]:
    """Sizes of a figure's letters on the screen [CSS pixel]; matplotlib draws them at `scale(points / 100)`."""
    svg = base64.b64decode(uri.partition(",")[2]).decode()
    match = re.search(r'viewBox="0 0 ([\d.]+) ', svg)
    assert match
    return [100 * float(scale) * width / float(match[1]) for scale in re.findall(r"scale\(([\d.]+) -[\d.]+\)", svg)]


def test_the_page_asks_for_nothing_and_names_from_the_data_do_nothing(phone: Any, file: Path) -> None:
    assert [url for url in phone.asked if not url.startswith("data:")] == [file.as_uri()]
    assert "stand-in robot" in phone.title()
    assert phone.evaluate("document.querySelectorAll('script').length") == 1
    assert '<script>document.title="owned"</script>' in phone.inner_text("body")
    refused = "() => fetch('https://example.org/').then(() => 'came', () => 'refused')"
    assert phone.evaluate(refused) == "refused"


def test_the_film_plays_pauses_steps_and_scrubs_by_mouse_and_keyboard(phone: Any) -> None:
    figure, play = phone.locator("figure.film"), phone.locator(".play")
    slider, clock = phone.locator(".film input"), phone.locator(".film output")
    still = phone.evaluate("document.querySelector('.film img').style.transform")
    assert (figure.get_attribute("data-state"), play.inner_text()) == ("playing", "Pause")  # by itself
    play.click()
    assert (figure.get_attribute("data-state"), play.inner_text()) == ("paused", "Play")
    play.click()
    assert (figure.get_attribute("data-state"), play.inner_text()) == ("playing", "Pause")
    # not `wait_for_function`: it evaluates in the page, which the page's own policy forbids
    sync_api.expect(slider).to_have_value(re.compile("^([2-9]|1[01])$"))
    play.press("Enter")
    assert figure.get_attribute("data-state") == "paused"
    slider.fill("5")
    assert phone.evaluate("document.querySelector('.film img').style.transform") != still
    assert clock.inner_text() == "0.5 of 1.1 s"
    phone.locator(".ahead").click()
    assert slider.input_value() == "6"
    slider.press("ArrowLeft")
    phone.locator(".back").click()
    assert slider.input_value() == "4"


def test_with_reduced_motion_the_film_stands_still_and_plays_once(browser: Any, file: Path) -> None:
    shown = browser.new_page(reduced_motion="reduce")
    shown.goto(file.as_uri())
    assert shown.locator("figure.film").get_attribute("data-state") == "paused"
    shown.locator(".film input").fill("10")
    shown.locator(".play").click()
    shown.wait_for_selector("figure.film[data-state=paused]")
    assert shown.locator(".film input").input_value() == "11"
    shown.close()


def test_without_scripts_the_film_is_a_still_without_dead_buttons(browser: Any, file: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    shown = context.new_page()
    shown.goto(file.as_uri())
    assert shown.locator(".film img").is_visible() and not shown.locator(".play").is_visible()
    context.close()


@pytest.mark.parametrize("width", [390, 1440, 2560])
def test_lines_stay_readable_and_figures_fill_the_width(browser: Any, file: Path, width: int) -> None:
    shown = browser.new_page(viewport={"width": width, "height": 900})
    shown.goto(file.as_uri())
    longest = "Math.max(...[...document.querySelectorAll('p, li')].map(e => e.getBoundingClientRect().width))"
    assert shown.evaluate(longest) < 900
    wide = "[...document.querySelectorAll('.figures figure, table')]"
    right = f"Math.max(...{wide}.map(e => e.getBoundingClientRect().right))"
    assert shown.evaluate(right) > 0.7 * width
    shown.close()


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page that opens with the robot won back, and a film of two runs side by side."""
    frames = np.zeros((12, 300, 584, 3), np.uint8)
    frames[:] = np.arange(12)[:, None, None, None] * 20
    panels = ("before: falls after 1.9 s", "refined: followed to the end")
    block = film(sheet(frames, 10.0), "walk_fast", "The counted episodes themselves.", "The robot twice.", panels)
    path = tmp_path_factory.mktemp("first") / "report.html"
    path.write_text(page_of(won_back(), film=[heading("The same motion on the robot, before and after"), block]))
    return path


@pytest.mark.parametrize(("width", "height"), [(390, 844), (1440, 900)])
def test_the_first_screen_is_whole_and_can_be_read(browser: Any, first: Path, width: int, height: int) -> None:
    shown = browser.new_page(viewport={"width": width, "height": height})
    shown.goto(first.as_uri())
    assert shown.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert shown.evaluate("document.querySelector('.opening').getBoundingClientRect().top") < 0.3 * height
    cut = """() => [...document.querySelectorAll('.opening *')].filter(e => {
        if (e.closest('.screen, caption')) return false;
        const box = e.getBoundingClientRect();
        return box.width && (box.right > innerWidth + 1 || box.left < -1 || e.scrollWidth > e.clientWidth + 1
            && getComputedStyle(e).display != 'inline' && e.clientWidth);
    }).map(e => e.outerHTML.slice(0, 80))"""
    assert shown.evaluate(cut) == []
    small = f"""() => [...document.querySelectorAll('.opening *')].filter(e => e.innerText?.trim()
        && parseFloat(getComputedStyle(e).fontSize) < {SMALLEST}).map(e => e.outerHTML.slice(0, 80))"""
    assert shown.evaluate(small) == []
    bottom = "document.querySelector('.opening {}').getBoundingClientRect().bottom"
    if width > 1000:  # beside each other: all of it fits
        assert shown.evaluate(bottom.format("table.bars")) < height
        assert shown.evaluate(bottom.format(".film .controls")) < height
    assert shown.evaluate(bottom.format(".warning")) < height / 2
    shown.close()


def test_one_button_plays_both_runs_and_each_has_its_heading(browser: Any, first: Path) -> None:
    shown = browser.new_page(viewport={"width": 390, "height": 844})
    shown.goto(first.as_uri())
    assert shown.locator(".opening .play").count() == shown.locator(".opening .screen img").count() == 1
    halves = shown.evaluate("[...document.querySelectorAll('.panels span')].map(e => e.getBoundingClientRect().left)")
    assert halves[1] > 390 / 2 - 10 > halves[0]
    assert "before: falls after 1.9 s" in shown.inner_text(".panels")
    sync_api.expect(shown.locator(".film input")).to_have_value(re.compile("^([2-9]|1[01])$"))
    shown.close()


def test_the_mouse_reads_a_learning_curve_and_a_steps_words(browser: Any, first: Path) -> None:
    shown = browser.new_page(viewport={"width": 1440, "height": 900})
    shown.goto(first.as_uri())
    plot = shown.locator("figure.curves svg").first
    plot.hover()
    said = shown.locator("figure.curves output").first.inner_text()
    assert said.startswith("At ") and "base" in said and "%" in said
    strip = shown.locator(".strip.tipped").first
    strip.hover()
    words = shown.evaluate("getComputedStyle(document.querySelector('.strip.tipped'), '::after').content")
    assert "points" in words or "mrad" in words
    shown.close()


def test_in_the_dark_letters_are_light_on_dark(browser: Any, first: Path) -> None:
    shown = browser.new_page(color_scheme="dark")
    shown.goto(first.as_uri())
    light = """e => getComputedStyle(document.body)[e].match(/\\d+/g).slice(0, 3).map(Number)"""
    assert min(shown.evaluate(light, "color")) > 180 and max(shown.evaluate(light, "backgroundColor")) < 60
    shown.close()


def test_a_bar_is_as_long_as_its_share(browser: Any, first: Path) -> None:
    shown = browser.new_page(viewport={"width": 1440, "height": 900})
    shown.goto(first.as_uri())
    share = "(() => { const b = [...document.querySelectorAll('.bar')][0], i = b.querySelector('i');"
    share += " return i.getBoundingClientRect().width / b.getBoundingClientRect().width })()"
    assert shown.evaluate(share) == pytest.approx(0.22, abs=0.01)
    shown.close()
