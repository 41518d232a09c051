"""The terminal of a loop: one line a stage, errors loud; the log file has every line."""

import io
import logging
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest
from prefect.logging.handlers import PrefectConsoleHandler

from bumblebee import cli
from flows import demo, loop, terminal, walk
from flows.environment import SERVERS
from flows.servers.servers import Addresses


@pytest.fixture
def screen(tmp_path: Path) -> Iterator[io.StringIO]:
    """The stream of the root logger's only console, as Prefect makes it."""
    (tmp_path / SERVERS).mkdir()
    root, shown = logging.getLogger(), io.StringIO()
    before = list(root.handlers)
    console = PrefectConsoleHandler(stream=shown)
    console.setFormatter(logging.Formatter("%(name)s | %(message)s"))
    root.handlers = [console]
    yield shown
    for handler in root.handlers:
        handler.close()
    root.handlers = before


def stage(folder: Path, monkeypatch: pytest.MonkeyPatch, *code: str) -> None:
    """Run a stage whose process is these lines."""
    (folder / "tiny.py").write_text("\n".join(code))
    log = logging.getLogger("train")
    log.setLevel(logging.INFO)
    monkeypatch.setattr(loop, "get_run_logger", lambda: log)
    monkeypatch.setattr(loop, "runner_of", lambda workspace: "tiny")
    monkeypatch.setattr(loop, "devices_of", lambda *_: nullcontext({}))
    loop.run_stage.fn("train", "train", str(folder))


DONE = ("print('Running stage train')", "print('epoch 1')", "print('epoch 2')")


def test_a_stage_that_went_well_is_one_line_with_its_time_and_all_lines_are_in_the_file(
    tmp_path: Path, screen: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal.to_file(tmp_path, verbose=False)
    monkeypatch.setattr(loop, "took", lambda seconds: "2:05 min")
    stage(tmp_path, monkeypatch, *DONE)
    assert screen.getvalue().splitlines() == ["train | done in 2:05 min"]
    written = (tmp_path / terminal.FILE).read_text().splitlines()
    assert written == ["train | epoch 1", "train | epoch 2", "train | done in 2:05 min"]


def test_a_stage_that_failed_says_so_at_once_with_its_last_lines(
    tmp_path: Path, screen: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal.to_file(tmp_path, verbose=False)
    stage(tmp_path, monkeypatch, *DONE, "raise SystemExit('motions: expected a folder, came none')")
    (line,) = screen.getvalue().splitlines()
    assert line.startswith("train | failed after 0:")
    assert line.endswith(" min: epoch 1 / epoch 2 / motions: expected a folder, came none")


def test_verbose_shows_every_line(tmp_path: Path, screen: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    terminal.to_file(tmp_path, verbose=True)
    stage(tmp_path, monkeypatch, *DONE)
    assert screen.getvalue() == (tmp_path / terminal.FILE).read_text()
    assert screen.getvalue().startswith("train | epoch 1\n")


def test_warnings_and_errors_of_any_library_stay_loud(tmp_path: Path, screen: io.StringIO) -> None:
    terminal.to_file(tmp_path, verbose=False)
    for level in (logging.WARNING, logging.ERROR):
        logging.getLogger("bumblebee").log(level, "round 1 waits")
    assert screen.getvalue().count("round 1 waits") == 2


def test_a_disk_that_takes_no_line_costs_that_line_alone(
    tmp_path: Path, screen: io.StringIO, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / terminal.FILE).symlink_to("/dev/full")
    terminal.to_file(tmp_path, verbose=False)
    logging.getLogger("train").error("no space")
    assert screen.getvalue() == "train | no space\n" and capsys.readouterr().err == ""
    logging.getLogger().handlers.pop()  # its end would try once more


def test_a_line_about_a_stage_is_shown_after_prefects_server_went_away() -> None:
    made = logging.LogRecord("prefect.task_runs", terminal.NOTICE, "", 0, "done in 0:02 min", None, None)
    assert walk.of_a_stage(made) and terminal.is_notice(made)


@pytest.mark.parametrize(
    ("seconds", "said"), [(0.4, "0:00 min"), (59.6, "1:00 min"), (125, "2:05 min"), (7260, "121:00 min")]
)
def test_every_duration_is_in_minutes_and_seconds(seconds: float, said: str) -> None:
    assert terminal.took(seconds) == said


@pytest.mark.parametrize(("given", "passed"), [([], ()), (["--verbose"], ("--verbose",))])
def test_the_log_files_path_is_printed_once_and_verbose_reaches_the_walk(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    given: list[str],
    passed: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    asked: list[tuple[str, ...]] = []
    for name in ("require_own", "private_index", "check_cluster", "start_check", "finish_check", "read_stages"):
        monkeypatch.setattr(demo, name, lambda *_: None)
    monkeypatch.setattr(demo, "environment", lambda folder: {})
    monkeypatch.setattr(demo.params, "check_names", lambda *_: None)
    monkeypatch.setattr(demo.params, "read", lambda *_: {})
    monkeypatch.setattr(demo.sections, "loop", lambda *_: None)
    monkeypatch.setattr(demo, "changed_stages", lambda *_: None)
    monkeypatch.setattr(demo, "to_run", lambda *_: {"train"})
    kept = Addresses("http://127.0.0.1:1", "http://127.0.0.1:2", 1, (2, 3))
    monkeypatch.setattr(demo, "servers", lambda *_: nullcontext(kept))
    monkeypatch.setattr(demo, "attend", lambda folder, addresses, *options: asked.append(options) or 0)
    assert cli.run(["demo", "--workspace", ".", *given]) == 0
    said = capsys.readouterr().out
    assert said.count(f"{SERVERS}/loop.log") == 1 and "http://127.0.0.1:2/#/models" in said
    assert asked == [passed]
