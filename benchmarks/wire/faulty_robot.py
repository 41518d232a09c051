"""The stand-in robot's process for the soak: lines on its standard input make its states faulty for a while.

    python -m benchmarks.wire.faulty_robot WIRE SEED        then lines such as `nan 0.3`, `burst 1.2` [s]

`nan`: no numbers for the base's orientation. `burst`: states are held back, and then come all at once.
"""

import sys
import threading
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.robot.sensors import Sensors
from bumblebee.sim.quiet import quiet_mujoco
from bumblebee.wire.clock import SECOND, Clock
from bumblebee.wire.links.line import LineFaults
from bumblebee.wire.messages import Mode, State
from bumblebee.wire.realtime import ROBOT, harden
from bumblebee.wire.robot_end.robot import RobotSettings, WireRobot
from bumblebee.wire.robot_end.robot_process import run_robot

until = {"nan": 0, "burst": 0}
"""When each fault is over, by the monotonic clock [ns]."""


class FaultyRobot(WireRobot):
    """A robot whose states are faulty until a time."""

    _kept: list[tuple[str, bytes]] = []  # noqa: RUF012  (one robot a process)

    def advance(self, now: int, orders: Sequence[bytes]) -> list[tuple[str, bytes]]:
        """See `WireRobot.advance`; holds back what it says in a burst."""
        said = self._kept + super().advance(now, orders)
        self._kept = said if now < until["burst"] else []
        return [] if self._kept else said

    def _state(self, mode: Mode, read: Sensors, true: Sensors) -> State:
        state = super()._state(mode, read, true)
        return replace(state, base_quat=np.full(4, np.nan)) if self.next_period < until["nan"] else state


def obey() -> None:
    """Take lines until there are none."""
    for line in sys.stdin:
        what, seconds = line.split()
        until[what] = Clock().now() + round(float(seconds) * SECOND)


def main() -> None:
    """Run the process."""
    wire, seed = sys.argv[1], int(sys.argv[2])
    quiet_mujoco()
    threading.Thread(target=obey, daemon=True).start()
    line = LineFaults(jitter=0.0005)
    harden(ROBOT)
    print("ready", flush=True)
    run_robot(wire, "", [], RobotSettings(seed=seed, states=line, orders=line), make=FaultyRobot)


if __name__ == "__main__":
    main()
