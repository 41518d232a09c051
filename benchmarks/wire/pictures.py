"""The operator's three pages as pictures for docs/deploy.md: the sheet before a run, the run, and what came.

Everything is real but the robot: a sheet is made, the simulated robot and a run with its page are started on loopback,
and a browser looks at each page, as wide as a desk's screen and as a phone's.

    python -m benchmarks.wire.pictures --out docs/pictures       (--slow 4 on a busy machine)
"""

import argparse
import io
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

from bumblebee.io.write import write_file
from flows import login

CLIPS = ("squat", "walk", "kick_right")
WIDTHS = {1440: 900, 390: 844}
"""Width -> height of a screen [px]."""
_LARGEST = 60_000  # bytes
_BUMBLEBEE = [sys.executable, "-m", "bumblebee", "deploy"]


def main() -> None:
    """Write `operator-sheet`, `operator-live` and `operator-after` of each width into the output folder."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.wire.pictures")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--slow", type=float, default=1.0, help="times slower than real time")
    options = parser.parse_args()
    work = Path(tempfile.mkdtemp())
    chosen = [word for clip in CLIPS for word in ("--clip", clip)]
    subprocess.run([*_BUMBLEBEE, "sheet", "shipped", *chosen], cwd=work, check=True)
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        look(browser, (work / "sheet" / "sheet.html").as_uri(), options.out / "operator-sheet")
        live(browser, work, options)
        (after,) = (work / "deployed" / "pages").glob("*.html")
        look(browser, after.as_uri(), options.out / "operator-after")
        browser.close()
    shutil.rmtree(work)


def live(browser: Browser, work: Path, options: argparse.Namespace) -> None:
    """Look at the page while the policy carries the robot."""
    both = ["--at", str(work / "w"), "--slow", str(options.slow)]
    robot = subprocess.Popen([*_BUMBLEBEE, "robot", *both], cwd=work, stdout=subprocess.DEVNULL)
    words = ["run", "shipped", "--clip", "walk", "--sheet", "sheet", "--page", "0", "--unattended", *both]
    ran = subprocess.Popen([*_BUMBLEBEE, *words], cwd=work, stdout=subprocess.PIPE, text=True)
    try:
        assert ran.stdout is not None
        url = next(line for line in ran.stdout if line.startswith("page: ")).split()[1].rstrip(",")
        known = {"username": login.USER, "password": str(login.read(work / ".servers"))}
        look(browser, url, options.out / "operator-live", "text=carries itself", http_credentials=known)
        ran.stdout.read()
        ran.wait()
    finally:
        robot.terminate()
        robot.wait()


def look(browser: Browser, url: str, path: Path, when: str = "h1", **more: Any) -> None:
    """Save what the screens show once it is there."""
    pages = [
        browser.new_context(viewport={"width": width, "height": height}, **more).new_page()
        for width, height in WIDTHS.items()
    ]
    for page in pages:
        page.goto(url)
    for (width, _), page in zip(WIDTHS.items(), pages, strict=True):
        page.wait_for_selector(when, timeout=120_000)
        save(path.with_name(f"{path.name}{'' if width > 1000 else f'-{width}'}.webp"), page.screenshot())
        page.context.close()


def save(path: Path, png: bytes) -> None:
    """Write a picture as WebP of at most 60 kB."""
    picture, buffer = Image.open(io.BytesIO(png)).convert("RGB"), io.BytesIO()
    for quality in (90, 75, 60, 45, 30):
        buffer = io.BytesIO()
        picture.save(buffer, "webp", quality=quality, method=6)
        if buffer.tell() <= _LARGEST:
            break
    write_file(path, buffer.getvalue())
    print(f"written: {path}, {buffer.tell() / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
