"""Lines of long work that has no count: each step as it begins, and every ten seconds that it still goes on."""

import threading
import time
from types import TracebackType

from bumblebee.errors import plain
from bumblebee.progress import LINE_EVERY


class Teller:
    """Prints the steps of a search with the seconds since its beginning, and never stays silent longer than `every`.

    Args:
        every: longest silence [s].
    """

    def __init__(self, every: float = LINE_EVERY) -> None:
        self._every, self._began = every, time.monotonic()
        self._last, self._found = "reading", list[str]()
        self._done, self._lock, self._said = threading.Event(), threading.Lock(), self._began

    def __call__(self, text: str) -> None:
        """Say that a step begins, or what was found."""
        self._last = text
        if text.startswith("found "):
            self._found.append(text.removeprefix("found ").partition(":")[0].partition(",")[0])
        self._show(text)

    def __enter__(self) -> "Teller":
        threading.Thread(target=self._go_on, daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._done.set()

    def _go_on(self) -> None:
        while not self._done.wait(max(0.05, self._said + self._every - time.monotonic())):
            if time.monotonic() - self._said >= self._every:
                so_far = f"; {len(self._found)} found, at last {self._found[-1]}" if self._found else ""
                self._show(f"still: {self._last}{so_far}")

    def _show(self, text: str) -> None:
        with self._lock:
            self._said = time.monotonic()
            print(plain(f"[{self._said - self._began:5.1f} s] {text}"), flush=True)
