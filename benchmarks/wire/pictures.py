"""The operator's three pages as pictures for docs/deploy.md: the sheet before a run, a run, and what came.

    bumblebee deploy sheet shipped --clip squat --clip walk --clip kick_right --out sheet
    bumblebee deploy run shipped --clip walk --unattended --out deployed        # beside `bumblebee deploy robot`
    python -m benchmarks.wire.pictures sheet deployed --out docs/pictures

The live page is that of the middle of the newest run, from its journal.
"""

import argparse
import io
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from benchmarks.wire.common import shipped
from bumblebee.io.write import write_file
from bumblebee.view.after_page import after_page
from bumblebee.view.operator_page import live_page
from bumblebee.view.sheet_page import sheet_page
from bumblebee.wire.journal import read_journal
from bumblebee.wire.operator.screen import Numbers
from bumblebee.wire.operator.sheet_file import read_sheet
from bumblebee.wire.operator.watcher import facts_of
from bumblebee.wire.rollouts import ended_by
from bumblebee.wire.safety.limits import Limits, drives_of
from bumblebee.wire.safety.phases import Phase

WIDTHS = {1440: 1000, 390: 844}
"""Width -> height of a screen [px]."""
_LARGEST = 60_000  # bytes


def main() -> None:
    """Write `operator-sheet`, `operator-live` and `operator-after` of each width into the output folder."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.wire.pictures")
    parser.add_argument("sheet", type=Path)
    parser.add_argument("deployed", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    live, after = pages(options.deployed)
    for name, page in (("sheet", sheet_page(read_sheet(options.sheet))), ("live", live), ("after", after)):
        look(page, options.out / f"operator-{name}")


def pages(deployed: Path) -> tuple[str, str]:
    """The live page in the middle of the newest run, and the page after it."""
    journal = max((deployed / "journals").iterdir(), key=lambda path: path.stat().st_mtime)
    (about, rows), drives = read_journal(journal), drives_of(shipped().contract)
    running = rows[rows["phase"] == Phase.RUN]
    numbers, whole = Numbers(len(drives.joints)), Numbers(len(drives.joints))
    numbers.add(rows[: len(rows) - len(running) // 2].tobytes())
    whole.add(rows.tobytes())
    seconds = int(running["answers"].max()) / about["control_hz"]
    run = {"policy": about["policy"]["name"], "motion": about["motion"], "robot": "g1_23dof, simulated"}
    run |= {"hz": about["control_hz"], "seconds": seconds}
    live = live_page(run, facts_of(numbers, numbers.table(), drives, Limits()), 0.1)
    rollout = deployed / "rollouts" / f"{journal.stem}.parquet"
    counts = dict(whole.rules.most_common())
    return live, after_page(ended_by(rows), counts, whole.missed, rollout, Path("deployed"), Path())


def look(page: str, path: Path) -> None:
    """Save what each screen shows of a page."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as started:
        file = Path(folder) / "page.html"
        file.write_text(page)
        browser = started.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for width, height in WIDTHS.items():
            shown = browser.new_page(viewport={"width": width, "height": height}, java_script_enabled=False)
            shown.goto(file.as_uri())
            save(path.with_name(f"{path.name}{'' if width > 1000 else f'-{width}'}.webp"), shown.screenshot())
        browser.close()


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
