"""Keys of a terminal, one by one, and a few lines that are drawn over each other."""

import os
import select
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager


class Terminal:
    """The terminal that the process was started from; without one there are no keys.

    Args:
        number: file descriptor that keys come from.
    """

    def __init__(self, number: int = 0) -> None:
        self.keys = os.isatty(number)
        """Whether there are keys to be pressed."""
        self._number, self._drawn = number, 0

    @contextmanager
    def raw(self) -> Iterator[None]:
        """Keys come at once and unseen."""
        if not self.keys:
            yield
            return
        before = termios.tcgetattr(self._number)
        try:
            tty.setcbreak(self._number)
            yield
        finally:
            termios.tcsetattr(self._number, termios.TCSADRAIN, before)

    def pressed(self) -> str:
        """Keys since the last call."""
        if not self.keys or not select.select([self._number], [], [], 0)[0]:
            return ""
        return os.read(self._number, 1024).decode("latin-1")

    def draw(self, lines: list[str]) -> None:
        """Draw lines in the place of the last ones; nothing where nobody looks."""
        if not sys.stdout.isatty():
            return
        up = f"\x1b[{self._drawn}A" if self._drawn else ""
        sys.stdout.write(up + "".join(f"\x1b[2K{line}\n" for line in lines))
        sys.stdout.flush()
        self._drawn = len(lines)
