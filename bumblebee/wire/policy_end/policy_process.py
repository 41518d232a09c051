"""The policy's process: answers the guard's newest question, and ends when the guard is gone.

python -m bumblebee.wire.policy_end.policy_process POLICY CLIPS COMPENSATION SOCKET     (COMPENSATION may be empty)
"""

import select
import socket
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from bumblebee.wire.clock import SECOND
from bumblebee.wire.links import packets
from bumblebee.wire.links.lcm_codec import Codec
from bumblebee.wire.messages import Mode, State
from bumblebee.wire.policy_end.brain import Brain
from bumblebee.wire.policy_end.questions import Question, decode_question, encode_answer
from bumblebee.wire.realtime import POLICY, harden

READY = "ready"


_EARLY = 0.017  # s after a question, 3 ms before the next: what others left in the caches costs more than arithmetic


def load(policy: Path, clips: Path, compensation: Path | None) -> tuple[Brain, Brain]:
    """Two brains of a policy's folder and a library with one clip, tried once: one to answer, one to keep warm."""
    import torch

    from bumblebee.compensation.file import read_compensation
    from bumblebee.motion.store import read_library
    from bumblebee.policy.exported import ExportedPolicy

    torch.set_num_threads(1)
    (clip,) = read_library(clips)
    undone = read_compensation(compensation) if compensation else None
    exported = ExportedPolicy.load(policy)
    both = Brain(exported, clip, undone), Brain(exported, clip, undone)
    for tick in range(3):
        for brain in both:
            brain.answer(Question(tick, 0, _standing(brain.hold())))
    return both


def serve(brain: Brain, warm: Brain, end: socket.socket, joints: int) -> None:
    """Answer until nobody asks any more; `warm` answers the last question again just before the next, for nothing."""
    codec, newest = Codec(joints), b""
    wait: float | None = None
    while True:
        ready, _, _ = select.select([end], [], [], wait)
        if not ready:
            warm.answer(decode_question(newest, codec))
            wait = None
            continue
        try:
            newest, begun = packets.received(end)[-1], time.monotonic_ns()
            answer = brain.answer(decode_question(newest, codec))
            packets.send(end, encode_answer(replace(answer, took_ns=time.monotonic_ns() - begun)))
        except packets.Gone:
            return
        wait = max(0.0, _EARLY - (time.monotonic_ns() - begun) / SECOND)


def _standing(pose: np.ndarray) -> State:
    """A state to try the policy with."""
    zero, none = np.zeros_like(pose), np.zeros(3)
    upright, feet = np.array([1.0, 0, 0, 0]), np.zeros(2)
    return State(0, 0, 0, 0, pose, zero, zero, upright, none, none, none, feet, zero, zero, Mode.OFF, 0, -1, 0)


def main() -> None:
    """Run the process."""
    policy, clips, compensation, number = sys.argv[1:5]
    brain, warm = load(Path(policy), Path(clips), Path(compensation) if compensation else None)
    harden(POLICY)
    print(READY, flush=True)
    serve(brain, warm, socket.socket(fileno=int(number)), len(brain.hold()))


if __name__ == "__main__":
    main()
