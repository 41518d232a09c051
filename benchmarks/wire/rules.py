"""Each safety rule tripped once, with the time until the drives damp, on a robot of three joints without physics."""

import argparse

from bumblebee.wire.safety.phases import Phase
from tests.wire.test_guard import TRIPS, tripped_run


def run(options: argparse.Namespace) -> None:
    print("| what happens | rule | damped after [ms] |\n|---|---|---|")
    for what in TRIPS:
        small = tripped_run(what)
        damped = small.until(Phase.DAMP) - small.at
        print(f"| {what} | `{small.guard.reason}` | {max(0.0, 1e3 * damped):.0f} |")
