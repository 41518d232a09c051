"""The guard's process: wire on one side, policy and console on the other, 200 ticks a second by absolute deadlines.

    python -m bumblebee.wire.safety.guard_process JOB CONSOLE POLICY   (a JSON object, two inherited sockets' numbers)

When the console is gone it damps, says that the robot is off, and ends. When it is gone itself, the robot damps by its
own deadline. It alone writes to the wire.
"""

import json
import socket
import sys
from contextlib import suppress

from bumblebee.errors import BadInput
from bumblebee.wire.clock import SECOND, Clock
from bumblebee.wire.job import Job, decode_job
from bumblebee.wire.journal import Entry, record
from bumblebee.wire.links import packets
from bumblebee.wire.links.lcm_codec import Codec
from bumblebee.wire.links.link import Link, open_link
from bumblebee.wire.messages import ORDER, STATE
from bumblebee.wire.operator.keys import decode_keys
from bumblebee.wire.policy_end.questions import decode_answer, encode_question
from bumblebee.wire.realtime import GUARD, harden
from bumblebee.wire.safety.guard import PERIOD, Guard

_EARLY = SECOND // 1000  # ns before a tick to wake up: what others left in the caches costs more than the arithmetic
RECORD, END = b"R", b"E"
"""First byte of what the console gets: a journal's record, or how the run ended, as JSON."""


class GuardLoop:
    """A guard with its three lines.

    Args:
        job: of the run.
        link: to the robot.
        console: packets to and from the console.
        policy: packets to and from the policy's worker.
    """

    def __init__(self, job: Job, link: Link, console: socket.socket, policy: socket.socket) -> None:
        self._clock, self._joints = Clock(job.slow), len(job.drives.joints)
        self._link, self._console, self._policy = link, console, policy
        self._codec = Codec(self._joints)
        self._guard = Guard(job.plan, job.drives, self._clock.now())
        self._missed = self._unwritten = 0

    def run(self) -> dict[str, object]:
        """Tick until the run is over; how it ended."""
        deadline = self._clock.now() + PERIOD
        while not self._guard.finished:
            self._clock.sleep_until(deadline - _EARLY)
            self._listen(self._clock.now())
            self._guard.warm()
            self._clock.spin_until(deadline)
            missed = self._tick(deadline)
            self._missed += missed
            deadline += (1 + missed) * PERIOD
        guard = self._guard
        counts = {"missed": self._missed, "unwritten": self._unwritten, "refused": dict(guard.intake.refused)}
        return {"reason": guard.reason, **counts}

    def _tick(self, deadline: int) -> int:
        """One tick; the number of deadlines that passed while it was late."""
        awake = self._clock.now()
        missed = max(0, (awake - deadline) // PERIOD)
        self._listen(awake)
        heard = self._clock.now()
        tick = self._guard.tick(heard, missed)
        thought = self._clock.now()
        self._link.send(ORDER, self._codec.encode_order(tick.order))
        sent = self._clock.now()
        with suppress(packets.Gone):
            if tick.question is not None:
                packets.send(self._policy, encode_question(tick.question, self._codec))
        stages = (awake - deadline, heard - awake, thought - heard, sent - thought)
        intake = self._guard.intake
        entry = Entry(tick, intake.state, intake.came, missed, stages)
        with suppress(packets.Gone):
            self._unwritten += not packets.send(self._console, RECORD + record(entry, self._joints))
        return missed

    def _listen(self, now: int) -> None:
        """Take what robot, policy and console have said; who is gone says nothing, and rules ask for that."""
        for channel, message in self._link.received():
            if channel == STATE:
                with suppress(BadInput):
                    self._guard.heard(now, self._codec.state(message))
        with suppress(packets.Gone):
            for message in packets.received(self._policy):
                self._guard.answered(decode_answer(message, self._joints))
        with suppress(packets.Gone):
            for message in packets.received(self._console):
                self._guard.told(now, decode_keys(message))


def main() -> None:
    """Run the process."""
    job, ends = decode_job(sys.argv[1]), [socket.socket(fileno=int(number)) for number in sys.argv[2:4]]
    permitted = harden(GUARD)  # before the wire is opened: its threads take over what the process is permitted
    link = open_link(job.wire, [STATE], job.at)
    loop = GuardLoop(job, link, *ends)
    try:
        ended = loop.run()
    finally:
        link.close()
    with suppress(packets.Gone):
        packets.send(ends[0], END + json.dumps(ended | {"permitted": permitted}).encode())


if __name__ == "__main__":
    main()
