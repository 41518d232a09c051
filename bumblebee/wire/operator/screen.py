"""Live numbers of a run for a terminal: phase, latencies of every stage, what was counted."""

import math
from collections import Counter
from typing import Any

import numpy as np

from bumblebee.wire.journal import STAGES, layout
from bumblebee.wire.safety.phases import Phase
from bumblebee.wire.safety.rules import RULES, Step

_LEAST, _STEP, _BINS = 1e-3, 1.01, 2100  # ms, and bins that are 1 % wide up to 10**6 ms

Table = dict[str, tuple[float, float, float]]
"""Stage -> median, 99th percentile and worst [ms]."""


class Durations:
    """Durations of one stage, however many, counted in bins: a look at them costs the cores next to nothing."""

    def __init__(self) -> None:
        self._counts = np.zeros(_BINS, dtype=np.int64)
        self.worst = 0.0
        """Longest [ms]."""

    def add(self, milliseconds: float) -> None:
        """Count one."""
        place = math.ceil(math.log(max(milliseconds, _LEAST) / _LEAST) / math.log(_STEP))
        self._counts[min(place, _BINS - 1)] += 1
        self.worst = max(self.worst, milliseconds)

    def percentile(self, percent: float) -> float:
        """Duration [ms] that so many percent do not exceed, 1 % too large at most; NaN for none."""
        total = np.cumsum(self._counts)
        if not total[-1]:
            return math.nan
        return min(_LEAST * _STEP ** int(np.searchsorted(total, percent / 100 * total[-1])), self.worst)


class Numbers:
    """Durations and counts of a run so far.

    Args:
        joints: number of them.
    """

    def __init__(self, joints: int) -> None:
        self._layout = layout(joints)
        self._times = {name: Durations() for name in (*STAGES, "wake to send", "policy", "state age")}
        self.rules: Counter[str] = Counter()
        """Rule -> ticks in which it asked for anything."""
        self.missed = 0
        """Deadlines of the guard that passed."""
        self.count = 0
        """Records so far."""
        self.row: Any = None
        """Newest record."""
        self._answer = -1

    def add(self, records: bytes) -> None:
        """Count records of the journal."""
        for row in np.frombuffer(records, self._layout):
            self.row = row
            self.count += 1
            for name in STAGES:
                self._times[name].add(1e-6 * row[name])
            self._times["wake to send"].add(1e-6 * sum(int(row[name]) for name in STAGES[1:]))
            self._times["state age"].add(1e-6 * (row["sent_ns"] - row["came_ns"]))
            if row["asked_ns"] != self._answer:
                self._answer = row["asked_ns"]
                self._times["policy"].add(1e-6 * row["took_ns"])
            self.missed += int(row["missed"])
            self.rules.update(name for bit, name in enumerate(RULES) if row["rules"] >> bit & 1)

    def table(self) -> Table:
        """Durations so far."""
        rows = {name: (one.percentile(50), one.percentile(99), one.worst) for name, one in self._times.items()}
        return {name: times for name, times in rows.items() if not math.isnan(times[0])}

    def lines(self, table: Table) -> list[str]:
        """A screen of a few lines with the `table` of now."""
        if self.row is None:
            return ["waiting for the guard"]
        row, phase, step = self.row, Phase(self.row["phase"]).name, Step(self.row["step"]).name
        height, hot = row["base_pos"][2], row["hottest"]
        warmth = "" if np.isnan(hot) else f", motors up to {hot:.0f} C"
        torque = float(np.abs(row["joint_torque"]).max())
        head = (
            f"{phase:<6} {step:<5} tick {int(row['answers']):5d}, pelvis {height:.2f} m, torque up to {torque:.0f} N m"
        )
        stages = [f"{name:<13}{p50:8.2f}{p99:8.2f}{worst:8.2f}" for name, (p50, p99, worst) in table.items()]
        rules = ", ".join(f"{name} {count}" for name, count in self.rules.most_common(6)) or "none"
        return [head + warmth, f"{'ms':<13}{'p50':>8}{'p99':>8}{'worst':>8}", *stages,
                f"missed ticks {self.missed}; rules: {rules}"]  # fmt: skip
