"""The note on a rollout about the wire that it came over: written behind the guard, read by the report."""

import re

_NOTE = "wire: stamp to drives {:.1f} ms, worst {:.1f} ms"
_MEDIAN = re.compile(r"wire: stamp to drives ([0-9]+\.[0-9]) ms")


def wire_note(median: float, worst: float) -> str:
    """Text for a rollout's `notes` on the time from a state's stamp until the drives took the answer to it [s]."""
    return _NOTE.format(1e3 * median, 1e3 * worst)


def noted_latency(notes: str) -> float | None:
    """Median [s] that a rollout's `notes` hold; None where they hold none."""
    found = _MEDIAN.search(notes)
    return float(found[1]) / 1e3 if found else None
