"""Live numbers of a run for a terminal: phase, latencies of every stage, what was counted."""

from array import array
from collections import Counter
from typing import Any

import numpy as np

from bumblebee.wire.journal import STAGES, layout
from bumblebee.wire.phases import Phase
from bumblebee.wire.rules import RULES, Step

_KEEP = 200 * 60 * 20  # ticks whose durations are remembered: twenty minutes


Table = dict[str, tuple[float, float, float]]
"""Stage -> median, 99th percentile and worst [ms]."""


class Numbers:
    """Durations and counts of a run so far.

    Args:
        joints: number of them.
    """

    def __init__(self, joints: int) -> None:
        self._layout = layout(joints)
        self._times = {name: array("d") for name in (*STAGES, "wake to send", "policy", "state age")}
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
                self._note(name, row[name])
            self._note("wake to send", sum(int(row[name]) for name in STAGES[1:]))
            self._note("state age", row["sent_ns"] - row["came_ns"])
            if row["asked_ns"] != self._answer:
                self._answer = row["asked_ns"]
                self._note("policy", row["took_ns"])
            self.missed += int(row["missed"])
            self.rules.update(name for bit, name in enumerate(RULES) if row["rules"] >> bit & 1)

    def table(self) -> Table:
        """Durations so far."""
        rows = {name: np.frombuffer(times).copy() for name, times in self._times.items() if times}
        return {name: (*np.percentile(times, (50, 99)), times.max()) for name, times in rows.items()}

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

    def _note(self, name: str, nanoseconds: int) -> None:
        times = self._times[name]
        if len(times) < _KEEP:
            times.append(float(nanoseconds) * 1e-6)
