"""Hours of faults in the guard's own time: silence, bursts of late states, NaN, a policy that hangs, a console gone."""

import argparse
from collections import Counter
from dataclasses import replace

import numpy as np

from bumblebee.wire.safety.limits import Limits
from bumblebee.wire.safety.phases import Phase
from tests.wire.small import Small, plan

LIMITS = Limits()
NAN = np.full(3, np.nan)
DEADLINES = {"silent": LIMITS.state_damp, "policy": LIMITS.policy_damp + 0.02, "console": LIMITS.console}


def run(options: argparse.Namespace) -> None:
    rng, lived = np.random.default_rng(options.seed), 0.0
    runs, damped, wrong, over = Counter[str](), Counter[str](), Counter[str](), dict.fromkeys(DEADLINES, 0.0)
    while lived < 60 * options.minutes:
        kind = str(rng.choice(["silent", "burst", "nan", "policy", "console"]))
        lasts = float(np.exp(rng.uniform(np.log(0.05), np.log(5.0))))
        small = faulty(kind, lasts)
        small.at = small.until(Phase.RUN) + float(rng.uniform(0.0, 1.0))
        begun = len(small.ticks)
        small.run(small.at - small.ticks[-1].order.stamp_ns * 1e-9 + lasts + 0.2)
        lived += small.ticks[-1].order.stamp_ns * 1e-9
        rule = {"policy": "policy", "console": "console"}.get(kind, "silent")
        runs[kind] += 1
        first = next((t.order.stamp_ns * 1e-9 for t in small.ticks[begun:] if t.phase >= Phase.DAMP), None)
        if first is not None:
            damped[kind] += 1
            over[rule] = max(over[rule], first - small.at - DEADLINES[rule])
        elif lasts > DEADLINES[rule] + 0.025:
            wrong[kind] += 1
    print(f"{lived / 3600:.2f} h, {sum(runs.values())} faults: {dict(runs)}; damped: {dict(damped)}")
    print(f"not damped though the fault lasted beyond the deadline: {dict(wrong) or 0}")
    print("latest damping after its deadline [ms]: " + ", ".join(f"{k} {1e3 * v:.1f}" for k, v in over.items()))


def faulty(kind: str, lasts: float) -> Small:
    """A long run in which a fault of a kind begins at `at` and lasts so long [s]."""
    made = plan(frames=10**6)
    if kind == "policy":
        return Small(made, says=lambda answer, late: answer if late > lasts else None)
    if kind == "console":
        return Small(made, keys=lambda keys, late: keys if late > lasts else None)
    if kind == "nan":
        return Small(made, seen=lambda s, late: s if late > lasts else replace(s, base_quat=np.full(4, np.nan)))
    if kind == "burst":  # states come, but old ones: numbers that go back
        return Small(made, seen=lambda s, late: s if late > lasts else replace(s, sequence=s.sequence - 10_000))
    return Small(made, seen=lambda s, late: s if late > lasts else None)
