"""The soak's judge: damping is timed from the deadline of the fault, and a journal with a gap has lost what follows."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.wire.soak_judge import GONE, KINDS, LATE, LIMITS, OWN, SILENT, judged, lost, must_damp
from benchmarks.wire.soak_told import told
from bumblebee.wire.clock import SECOND
from bumblebee.wire.journal import Entry, layout, record
from bumblebee.wire.messages import Mode
from bumblebee.wire.safety.guard import PERIOD
from bumblebee.wire.safety.phases import Phase
from tests.wire.made import order, state
from tests.wire.small import Small, plan

TICK = PERIOD / SECOND


def faulty(lasts: float, seconds: float, **hooks: Any) -> tuple[int, np.ndarray]:
    """When a fault began [ns], and the journal's records from then on."""
    small = Small(plan(frames=10**6), **{name: hook(lasts) for name, hook in hooks.items()})
    small.at = small.until(Phase.RUN) + 0.1
    records = []
    while len(small.ticks) * TICK < small.at + seconds:
        small.run(TICK)
        records.append(record(Entry(small.ticks[-1], small.guard.intake.state, small.guard.intake.came), 3))
    return round(small.at * SECOND), np.frombuffer(b"".join(records), layout(3))


def gone(lasts: float) -> Any:
    return lambda what, late: what if late > lasts else None


@pytest.mark.parametrize(("kind", "hook", "rule"), [(SILENT[0], "seen", "silent"), (LATE[0], "says", "policy_late")])
def test_damping_comes_within_a_tick_of_the_deadline(kind: str, hook: str, rule: str) -> None:
    begun, rows = faulty(1.0, 0.5, **{hook: gone})
    made = judged(kind, begun, rows)
    assert made.rule == rule and made.over is not None and -1e-9 <= made.over <= TICK + 1e-9
    assert judged(kind, begun, faulty(0.02, 0.5, **{hook: gone})[1]).over is None


def test_what_the_robot_does_by_itself_and_what_follows_a_console_are_timed_by_their_stamps() -> None:
    held = [state(k, 1_000_000_000 + k * 2_000_000, heard_ns=1_000_000_000) for k in range(20)]
    states = [replace(s, mode=Mode.DAMP) if k > 10 else s for k, s in enumerate(held)]
    assert judged(OWN[0], 0, np.zeros(0, layout(3)), states=states).over == pytest.approx(0.002)
    late = round((LIMITS.console + 0.003) * SECOND)
    orders = [replace(order(mode), stamp_ns=stamp) for mode, stamp in ((Mode.RUN, late - 5), (Mode.DAMP, late))]
    assert judged(GONE[0], 0, np.zeros(0, layout(3)), orders=orders).over == pytest.approx(0.003)
    assert judged(OWN[0], 0, np.zeros(0, layout(3)), states=held).over is None


def test_a_kill_loses_what_is_after_the_last_whole_stretch() -> None:
    _, rows = faulty(1.0, 0.5)
    end = int(rows["sent_ns"][-1])
    assert lost(end + 30_000_000, rows) == pytest.approx(0.03)
    assert lost(end, np.delete(rows, len(rows) - 20)) == pytest.approx(20 * TICK)


def test_each_kind_that_reaches_its_deadline_must_damp_and_the_sums_say_which_did_not() -> None:
    assert all(must_damp(kind, 1.0) for kind in KINDS) and not must_damp(LATE[0], 0.05)
    row = {"kind": SILENT[0], "must": True, "over": 0.004, "wake": 0.0, "seconds": 1800.0, "number": 0}
    late, never = row | {"over": 0.03, "wake": 0.028}, row | {"over": None, "number": 7}
    lines = told([row, late, never, {"kind": SILENT[0], "early": "it did not begin"}])
    assert lines[0] == "1.50 h, 3 faults; 1 runs ended before theirs"
    assert lines[3] == "| robot stopped | 3 | 2 | 30.0 | 1 | 1 |" and lines[4].endswith("[7]")
