"""Progress of the loop: what is left follows the graph, the past and the run's own pace; telling never ends a run."""

import io
import json
import logging
import re
from pathlib import Path
from threading import Event

import pytest
from rich.console import Console
from rich.live import Live

from flows import expectations, progress
from flows.stages import Stage


def staged(name: str, *needs: str) -> Stage:
    return Stage(name, f"python -m tasks.{name}", frozenset(needs), frozenset())


CHAIN = [staged("motions"), staged("experts@c0", "motions"), staged("experts@c1", "motions"),
         staged("distill", "experts@c0", "experts@c1")]  # fmt: skip
SECONDS = {"motions": 10.0, "experts@c0": 60.0, "experts@c1": 40.0, "distill": 20.0}


class Clock:
    """Time that stands still until it is told."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def made(folder: Path, width: int = 2) -> tuple[progress.Progress, Clock]:
    clock = Clock()
    return progress.Progress(folder, CHAIN, width, clock), clock


def test_time_left_is_the_longest_way_through_the_graph() -> None:
    assert expectations.seconds_left(CHAIN, SECONDS, [], {}, width=2) == 10 + 60 + 20
    assert expectations.seconds_left(CHAIN, SECONDS, [], {}, width=1) == 10 + 60 + 40 + 20
    assert expectations.seconds_left(CHAIN, SECONDS, ["motions", "experts@c1"], {"experts@c0": 45.0}, 2) == 15 + 20
    assert expectations.seconds_left(CHAIN, SECONDS, SECONDS, {}, 2) == 0


def test_a_stage_that_is_late_is_not_called_done() -> None:
    left = expectations.seconds_left(CHAIN, SECONDS, ["motions", "experts@c1"], {"experts@c0": 600.0}, 2)
    assert left == 60 + 20
    assert progress.share(SECONDS, ["motions", "experts@c1"], {"experts@c0": 600.0}) < 85


def test_earlier_runs_are_believed_by_their_median_and_only_so_far_as_this_run_confirms_them() -> None:
    earlier = {name: [value, 100 * value, value] for name, value in SECONDS.items()}
    first = expectations.expect(CHAIN, earlier, {})
    assert first.seconds == SECONDS and first.source == "from this workspace's earlier runs"
    slower = expectations.expect(CHAIN, earlier, {"motions": 50.0})
    assert slower.seconds["distill"] == 20 * (50 + 30) / (10 + 30)


def test_without_earlier_runs_shares_of_typical_durations_take_their_scale_from_this_run() -> None:
    assert expectations.expect(CHAIN, {}, {}).source == "estimate"
    typical = expectations.TYPICAL
    seen = expectations.expect(CHAIN, {}, {"motions": 3 * typical["motions"], "diagnose": 3 * typical["diagnose"]})
    assert 2 * typical["distill"] < seen.seconds["distill"] < 3 * typical["distill"]
    slow_place = expectations.expect(CHAIN[3:], {"base": [9.0 * typical["base"]]}, {})
    assert slow_place.seconds["distill"] > 4 * typical["distill"] and slow_place.source == "estimate"
    slow_start = expectations.expect(CHAIN, {}, {"motions": 10 + typical["motions"]})
    assert slow_start.seconds["distill"] < 1.3 * typical["distill"]
    assert expectations.expect(CHAIN, {"motions": [9.0]}, {}).source == "estimate"


def test_every_stage_of_the_loop_has_a_typical_duration() -> None:
    text = Path("dvc.yaml").read_text()
    kinds = {line.split("tasks.")[1].split()[0] for line in text.splitlines() if "python -m tasks." in line}
    assert kinds and kinds <= expectations.TYPICAL.keys()


def test_only_stages_that_worked_are_remembered_and_only_the_last_few(tmp_path: Path) -> None:
    for run in range(7):
        told, clock = made(tmp_path)
        told.start("motions")
        clock.now = 10.0 + run
        told.end("motions", worked=True)
        told.start("distill")
        told.end("distill", worked=False)
    assert expectations.read(tmp_path) == {"motions": [12.0, 13.0, 14.0, 15.0, 16.0]}


@pytest.mark.parametrize("text", ["", "[1]", "{", '{"motions": "x", "distill": [true, null, -1, "a", 1e99]}'])
def test_a_spoilt_memory_is_no_memory(tmp_path: Path, text: str) -> None:
    expectations.path(tmp_path).parent.mkdir()
    expectations.path(tmp_path).write_text(text)
    assert expectations.read(tmp_path) == {}


def test_a_memory_that_cannot_be_written_costs_nothing_else(tmp_path: Path) -> None:
    (tmp_path / ".servers").write_text("a file where the folder should be")
    expectations.remember(tmp_path, "motions", 1.0)
    assert expectations.read(tmp_path) == {}


def test_the_line_says_how_far_how_long_and_how_that_is_known(tmp_path: Path) -> None:
    expectations.path(tmp_path).parent.mkdir()
    expectations.path(tmp_path).write_text(json.dumps({name: [6 * value] for name, value in SECONDS.items()}))
    told, clock = made(tmp_path)
    told.start("motions")
    clock.now = 60.0
    told.end("motions", worked=True)
    told.start("experts@c0")
    told.start("experts@c1")
    percent, line = told.state()
    assert percent == pytest.approx(100 * 10 / 130)
    assert line == "about 8 min left; now: experts, experts; 1 of 4 stages done (from this workspace's last run)"


def test_the_time_left_has_one_unit() -> None:
    assert progress.words(12 * 60, 24 * 60) == "about 12 to 24 min left"
    assert progress.words(200 * 60, 200 * 60) == "about 200 min left" and progress.words(3, 9) == "less than 1 min left"


def test_without_earlier_runs_the_time_left_is_a_range_that_narrows(tmp_path: Path) -> None:
    told, clock = made(tmp_path)
    ranges = []
    for name in ("", "motions", "experts@c0"):
        if name:
            told.start(name)
            clock.now += expectations.TYPICAL[name.partition("@")[0]]
            told.end(name, worked=True)
        percent, line = told.state()
        ranges.append(2 - percent / 100)
        assert "(estimate)" in line
    assert ranges[0] == 2 and ranges == sorted(ranges, reverse=True)
    many = [staged(name) for name in ("diagnose", "control", "refine")]
    fresh = progress.Progress(tmp_path / "new", many, 1, clock).state()[1]
    low, high = map(int, re.search(r"about (\d+) to (\d+) min left", fresh).groups())  # type: ignore[union-attr]
    assert abs(high - 2 * low) <= 1


def test_a_server_that_is_gone_costs_one_line_and_not_the_run(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    def gone(percent: float, line: str) -> None:
        raise ConnectionError("refused")

    told, clock = made(tmp_path)
    shown = progress.Show(told, None, logging.getLogger("test"), gone)
    for second in range(0, 100, 10):
        clock.now = float(second)
        shown.look(None)
    shown.last("done")
    assert [r.message for r in caplog.records if r.levelname == "WARNING"] == [
        "the progress on Prefect's page stands still: ConnectionError"
    ]


def test_plain_lines_come_when_stages_ended_and_not_with_every_look(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    told, clock = made(tmp_path)
    shown = progress.Show(told, None, logging.getLogger("test"), None)
    for second in range(100):
        clock.now = float(second)
        if second == 50:
            told.start("motions")
            told.end("motions", worked=True)
        shown.look(None)
    assert len(caplog.records) == 2 and "1 of 4 stages done" in caplog.messages[1]


def test_log_lines_through_the_same_console_stay_whole_above_the_bar(tmp_path: Path) -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=80, color_system=None)
    told, _ = made(tmp_path)
    shown = progress.Show(told, console, logging.getLogger("test"), None)
    with Live(console=console, transient=True, auto_refresh=False) as live:
        shown.look(live)
        console.print("motions | 33 motions read", soft_wrap=True)
        shown.look(live)
    lines = re.split(r"[\r\n]|\x1b\[2K", re.sub(r"\x1b\[[?\d]*[hlA]", "", screen.getvalue()))
    assert "motions | 33 motions read" in [line.strip() for line in lines]
    assert any("min left; now: between stages" in line for line in lines), "what runs fits into a narrow terminal"
    assert all(len(line) <= 80 for line in lines if "min left" in line)


def test_the_bar_goes_through_the_console_of_the_log_lines_and_only_to_a_terminal() -> None:
    handler = logging.StreamHandler(io.StringIO())
    logging.getLogger().addHandler(handler)
    try:
        for ours, expected in ((True, True), (False, False)):
            handler.console = Console(file=io.StringIO(), force_terminal=ours)  # type: ignore[attr-defined]
            handler.console._environ = {"TERM": "xterm"}  # type: ignore[attr-defined]
            assert (progress.terminal() is handler.console) == expected  # type: ignore[attr-defined]
    finally:
        logging.getLogger().removeHandler(handler)


def test_a_fault_in_showing_is_told_and_does_not_spread(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    told, _ = made(tmp_path)
    told.state = lambda: 1 / 0  # type: ignore[method-assign, assignment, return-value]
    progress.Show(told, None, logging.getLogger("test"), None).keep(Event())
    assert "the progress is shown no more" in caplog.text


def test_a_run_is_followed_from_its_stages_to_its_last_word(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(progress, "terminal", lambda: None)
    monkeypatch.setattr(progress, "page", lambda: lambda percent, line: told.append(f"{percent:.0f} {line}"))
    close = progress.begin(tmp_path, CHAIN, {"motions", "distill"}, logging.getLogger("test"))
    with progress.stage(str(tmp_path), "motions") as said:
        said["worked"] = True
    with pytest.raises(RuntimeError), progress.stage(str(tmp_path), "distill"):
        raise RuntimeError("the process could not start")
    close("failed")
    close("stopped")
    assert told[-1].startswith("100 failed: 2 of 2 stages done")
    assert list(expectations.read(tmp_path)) == ["motions"]


def test_a_stage_outside_of_a_watched_run_runs_as_ever(tmp_path: Path) -> None:
    with progress.stage(str(tmp_path), "motions") as said:
        said["worked"] = True
