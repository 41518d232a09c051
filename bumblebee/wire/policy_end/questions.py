"""Between guard and policy: a question is a state at a control tick, an answer the wish for that tick."""

from dataclasses import dataclass

import numpy as np

from bumblebee.wire.links.lcm_codec import Codec
from bumblebee.wire.messages import State
from bumblebee.wire.safety.rules import Reference, Wish

_HEAD = np.dtype([("tick", "<i8"), ("asked_ns", "<i8")])


@dataclass(frozen=True)
class Question:
    """A state at a control tick, for which the policy's wish is asked."""

    tick: int
    """Control step of the clip; each question with 0 begins it anew from where the robot is."""
    asked_ns: int
    """By the guard's clock [ns]."""
    state: State


@dataclass(frozen=True)
class Answer:
    """Wish of the policy for a question."""

    tick: int
    asked_ns: int
    """That of the question."""
    sequence: int
    """Sequence of the state that it answers."""
    wish: Wish
    reference: Reference
    action: np.ndarray
    """(J,) raw output."""
    took_ns: int = 0
    """Time that the policy's process took for it [ns]."""


def encode_question(question: Question, codec: Codec) -> bytes:
    """Bytes of a question."""
    head = np.array([(question.tick, question.asked_ns)], _HEAD)
    return head.tobytes() + codec.encode_state(question.state)


def decode_question(message: bytes, codec: Codec) -> Question:
    """Question from the bytes of `encode_question`."""
    head = np.frombuffer(message, _HEAD, 1)[0]
    return Question(int(head["tick"]), int(head["asked_ns"]), codec.state(message[_HEAD.itemsize :]))


def _layout(joints: int) -> np.dtype:
    row = ("<f8", (joints,))
    names = ("target", "kp", "kd", "torque", "reference", "action")
    head = [
        ("tick", "<i8"),
        ("asked_ns", "<i8"),
        ("sequence", "<i8"),
        ("took_ns", "<i8"),
        ("quat", "<f8", (4,)),
        ("height", "<f8"),
    ]
    return np.dtype([*head, *((name, *row) for name in names)])


def encode_answer(answer: Answer) -> bytes:
    """Bytes of an answer."""
    record = np.zeros((), _layout(len(answer.action)))
    for name in ("tick", "asked_ns", "sequence", "action", "took_ns"):
        record[name] = getattr(answer, name)
    for name in ("target", "kp", "kd", "torque"):
        record[name] = getattr(answer.wish, name)
    record["reference"] = answer.reference.target
    record["quat"], record["height"] = answer.reference.quat, answer.reference.height
    return record.tobytes()


def decode_answer(message: bytes, joints: int) -> Answer:
    """Answer from the bytes of `encode_answer`."""
    read = np.frombuffer(message, _layout(joints), 1)[0]
    wish = Wish(*(read[name].copy() for name in ("target", "kp", "kd", "torque")))
    reference = Reference(read["reference"].copy(), read["quat"].copy(), float(read["height"]))
    tick, asked, sequence = (int(read[name]) for name in ("tick", "asked_ns", "sequence"))
    return Answer(tick, asked, sequence, wish, reference, read["action"].copy(), int(read["took_ns"]))
