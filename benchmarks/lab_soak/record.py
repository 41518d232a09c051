"""Record of what happened, a line of JSON each, written as it happens: a soak that is cut short can still be judged."""

import json
import threading
import time
from pathlib import Path
from typing import Any

Event = dict[str, Any]


class Record:
    """Lines of `record.jsonl`; `at` is seconds since 1970."""

    def __init__(self, path: Path) -> None:
        self.path, self._lock = path, threading.Lock()

    def write(self, what: str, **facts: Any) -> Event:
        """One line more."""
        event = {"what": what, "at": round(time.time(), 2), **facts}
        with self._lock, self.path.open("a") as file:
            file.write(json.dumps(event) + "\n")
        return event


def read(path: Path) -> list[Event]:
    """All whole lines; the last may have been cut."""
    found = []
    for line in path.read_text().splitlines():
        try:
            found.append(json.loads(line))
        except ValueError:
            continue
    return found
