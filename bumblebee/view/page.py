"""The page: choose, play, scrub, speed, follow, push; curves with the same cursor."""

import queue
import time
from collections.abc import Callable, Sequence

import numpy as np
import viser
from viser import uplot

from bumblebee.view.live import DIRECTIONS, LivePolicy
from bumblebee.view.scene import Picture
from bumblebee.view.sources import Entry, Source, found

_DRAWN_HZ, _TOLD_HZ = 25.0, 5.0  # pictures, and numbers and curves, a second
_LATE = 0.1  # s that are made up for; what is later still is left out
_LISTED = 500  # entries in the menu at most; all are searched
_COLOURS = ("#1f2937", "#2f6db5", "#0f9d58")


class Page:
    """Entries to choose from and the one that plays; `run` is its loop, in the caller's thread.

    Args:
        picture: where it is drawn.
        entries: at least one; the first is shown first.
        title: heading of the panel.
    """

    def __init__(self, picture: Picture, entries: Sequence[Entry], title: str) -> None:
        self._picture, self._entries = picture, entries
        self._wishes: queue.Queue[Callable[[], None]] = queue.Queue()
        self._playing, self._owed, self._frame = True, 0.0, 0
        self._by_label = {self._label(entry): entry for entry in entries}
        self._source: Source | None = None
        self._gui(picture.server.gui, title)
        self._choose(entries[0])

    def run(self, ticks: int | None = None) -> None:
        """Play until interrupted, or for a number of rounds."""
        before = time.monotonic()
        drawn = told = 0.0
        while ticks is None or ticks > 0:
            ticks = None if ticks is None else ticks - 1
            now = time.monotonic()
            self.step(now - before)
            before = now
            if now - drawn >= 1 / _DRAWN_HZ:
                drawn = now
                self._picture.show(self._source.qpos())  # type: ignore[union-attr]
            if now - told >= 1 / _TOLD_HZ:
                told = now
                self._tell()
            time.sleep(0.004)

    def step(self, seconds: float) -> None:
        """Do what was asked for in the page, then play `seconds` [s] of the wall clock."""
        while not self._wishes.empty():
            self._wishes.get()()
        source = self._source
        if not self._playing or source is None:
            return
        self._owed = min(self._owed + seconds * self._speed.value * source.fps, max(_LATE * source.fps, 1.0))
        while self._owed >= 1.0:
            self._owed -= 1.0
            self._frame = source.advance()

    def _gui(self, gui: viser.GuiApi, title: str) -> None:
        gui.add_markdown(f"**{title}**")
        labels = list(self._by_label)[:_LISTED]
        self._words = gui.add_text("Search", "", hint="Words of the name, the family or the caption.")
        self._menu = gui.add_dropdown("Show", labels, initial_value=labels[0])
        self._note = gui.add_markdown("")
        self._button = gui.add_button("Pause", icon=viser.Icon.PLAYER_PAUSE)
        self._time = gui.add_slider("Time [s]", 0.0, 1.0, 0.01, 0.0)
        self._speed = gui.add_slider("Speed", 0.1, 2.0, 0.1, 1.0)
        follow = gui.add_checkbox("Camera follows", True)
        self._others = gui.add_checkbox("Show the motion too", False, hint="What the policy follows, in pale blue.")
        self._push = gui.add_folder("Push")
        with self._push:
            strength = gui.add_slider("Change of speed [m/s]", 0.1, 2.0, 0.1, 0.6)
            ways = gui.add_button_group("To its", tuple(DIRECTIONS))
        self._plots = gui.add_folder("Curves")
        with self._plots:
            self._signal = gui.add_dropdown("Signal", ("none",))
        self._plot: viser.GuiUplotHandle | None = None

        self._words.on_update(self._asked(self._search))
        self._menu.on_update(self._asked(self._chosen))
        self._button.on_click(self._asked(self._toggle))
        self._time.on_update(self._asked(self._scrub))
        self._signal.on_update(self._asked(self._new_plot))
        follow.on_update(self._asked(lambda: self._picture.follow(follow.value)))
        self._others.on_update(self._asked(lambda: self._picture.show_others(self._others.value)))
        ways.on_click(self._asked(lambda: self._pushed(ways.value, strength.value)))

    def _asked(self, act: Callable[[], None]) -> Callable[[viser.GuiEvent], None]:
        """A callback that keeps what a person asked for until the loop does it; callbacks run in other threads."""

        def keep(event: viser.GuiEvent) -> None:
            if event.client_id is not None:  # None: this program set the value
                self._wishes.put(act)

        return keep

    @staticmethod
    def _label(entry: Entry) -> str:
        return f"{entry.name} ({entry.group})" if entry.group else entry.name

    def _search(self) -> None:
        labels = [self._label(entry) for entry in found(self._entries, self._words.value)][:_LISTED]
        self._menu.options = labels or ("nothing found",)
        if labels:
            self._menu.value = labels[0]  # type: ignore[misc]
            self._chosen()

    def _chosen(self) -> None:
        entry = self._by_label.get(self._menu.value)
        if entry is not None:
            self._choose(entry)

    def _choose(self, entry: Entry) -> None:
        source = entry.make()
        self._source, self._owed, self._frame = source, 0.0, 0
        self._entry = entry
        self._picture.choose(source.robots)
        self._time.max = max(round((source.frames - 1) / source.fps, 2), 0.01)
        live = isinstance(source, LivePolicy)
        self._push.visible = self._others.visible = live
        self._picture.show_others(self._others.value or not live)
        self._plots.visible = bool(source.curves)
        self._signal.options = tuple(source.curves) or ("none",)
        self._picture.show(source.qpos())
        self._tell()
        self._new_plot()

    def _toggle(self) -> None:
        self._playing, self._owed = not self._playing, 0.0
        self._button.label = "Pause" if self._playing else "Play"
        self._button.icon = viser.Icon.PLAYER_PAUSE if self._playing else viser.Icon.PLAYER_PLAY

    def _scrub(self) -> None:
        source = self._source
        if source is not None:
            self._frame = min(round(self._time.value * source.fps), source.frames - 1)
            source.seek(self._frame)
            self._owed = 0.0

    def _pushed(self, direction: str, speed: float) -> None:
        if isinstance(self._source, LivePolicy):
            self._source.push(direction, speed)

    def _tell(self) -> None:
        source = self._source
        if source is None:
            return
        self._time.value = round(self._frame / source.fps, 2)  # type: ignore[misc]
        text = "  \n".join(part for part in (self._entry.text, source.said()) if part)
        if self._note.content != text:
            self._note.content = text
        if self._plot is not None:
            self._plot.data = self._plotted(source)

    def _new_plot(self) -> None:
        if self._plot is not None:
            self._plot.remove()
            self._plot = None
        source = self._source
        if source is None or not source.curves:
            return
        series = [uplot.Series(label="s")]
        for name, colour in zip(source.lines, _COLOURS, strict=False):
            series.append(uplot.Series(label=name, stroke=colour, width=1.5))
        series.append(uplot.Series(label="now", stroke="#d9480f", width=1.5))
        with self._plots:
            self._plot = self._picture.server.gui.add_uplot(
                self._plotted(source), tuple(series), scales={"x": uplot.Scale(time=False)}, height=200
            )

    def _plotted(self, source: Source) -> tuple[np.ndarray, ...]:
        """Seconds, a line for each robot, and the cursor."""
        lines = source.curves.get(self._signal.value) or next(iter(source.curves.values()))
        values = [np.nan_to_num(np.asarray(line, dtype=np.float64)) for line in lines]
        low, high = min(line.min() for line in values), max(line.max() for line in values)
        now = np.full(source.frames, low)  # a line upright at the cursor; uPlot scales no NaN
        now[self._frame] = high
        return np.arange(source.frames) / source.fps, *values, now
