"""Messages as LCM's bytes, as `lcm-gen` would write them from bumblebee_wire.lcm: big-endian, a fingerprint first.

Written by hand since a message goes out every 5 ms: one NumPy record is filled, and no list is made of its numbers. A
test holds it against the code that `lcm-gen` makes.
"""

import re
import struct
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.wire.messages import VERSION, Card, Mode, Order, State

_WORD = (1 << 64) - 1
_KINDS = {"int32_t": ">i4", "int64_t": ">i8", "double": ">f8"}
MAX_JOINTS = 256
_CARD = ">Qiiqi"  # what stands before a card's texts

Member = tuple[str, str, str | int | None]
"""Name, type, and number of entries: a member's name, a number, None for one value."""


@cache
def members(struct_name: str) -> tuple[Member, ...]:
    """A struct of bumblebee_wire.lcm."""
    text = re.sub(r"//.*", "", files(__package__).joinpath("bumblebee_wire.lcm").read_text())
    body = re.search(rf"struct {struct_name}\s*{{(.*?)}}", text, re.DOTALL)
    assert body is not None, struct_name
    found = re.findall(r"(\w+)\s+(\w+)(?:\[(\w+)\])?\s*;", body[1])
    return tuple(
        (name, kind, None if not size else int(size) if size.isdigit() else size) for kind, name, size in found
    )


@dataclass(frozen=True)
class Codec:
    """Bytes of states and orders of a robot with `joints` joints, of one length each."""

    joints: int

    def encode_state(self, state: State) -> bytes:
        """The state's message."""
        return _packed("state_t", self.joints, state)

    def encode_order(self, order: Order) -> bytes:
        """The order's message."""
        return _packed("order_t", self.joints, order)

    def state(self, message: bytes) -> State:
        """State from the bytes of `encode_state`; BadInput for bytes that are no such message."""
        return State(**_moded("state", _unpacked("state", self.joints, message)))

    def order(self, message: bytes) -> Order:
        """Order from the bytes of `encode_order`; BadInput for bytes that are no such message."""
        return Order(**_moded("order", _unpacked("order", self.joints, message)))


def _moded(what: str, read: dict[str, Any]) -> dict[str, Any]:
    try:
        return read | {"mode": Mode(read["mode"])}
    except ValueError:
        raise BadInput(f"wire: {what}: mode", "0 to 3", str(read["mode"])) from None


def encode_card(card: Card) -> bytes:
    """The card's message."""
    numbers = np.concatenate(([card.state_hz], card.kp_most, card.kd_most)).astype(">f8").tobytes()
    head = struct.pack(_CARD, fingerprint("card_t"), VERSION, len(card.joints), card.robot, card.simulated)
    return head + b"".join(map(_text, (card.name, *card.joints))) + numbers


def decode_card(message: bytes) -> Card:
    """Card from the bytes of `encode_card`; BadInput for bytes that are no such message."""
    try:
        mark, version, count, robot, simulated = struct.unpack_from(_CARD, message)
        _check("card", mark, version)
        if not 1 <= count <= MAX_JOINTS:
            raise BadInput("wire: card: num_joints", f"1 to {MAX_JOINTS}", str(count))
        texts, at = [], struct.calcsize(_CARD)
        for _ in range(1 + count):
            (size,) = struct.unpack_from(">i", message, at)
            if not 1 <= size <= 256 or at + 4 + size > len(message):
                raise BadInput("wire: card: name", "a text of at most 255 bytes", f"{size} bytes")
            texts.append(message[at + 4 : at + 3 + size].decode())
            at += 4 + size
        numbers = np.frombuffer(message, ">f8", 1 + 2 * count, at).astype(np.float64)
    except (struct.error, ValueError) as error:
        raise BadInput("wire: card", "a message of bumblebee_wire.lcm", str(error)[:80]) from None
    return Card(
        robot,
        bool(simulated),
        texts[0],
        tuple(texts[1:]),
        float(numbers[0]),
        numbers[1 : 1 + count],
        numbers[1 + count :],
    )


@cache
def fingerprint(struct_name: str) -> int:
    """LCM's number of a struct, from its members' names, types and sizes."""
    value = 0x12345678
    for name, kind, size in members(struct_name):
        value = _mixed_text(_mixed_text(value, name), kind)
        value = _mixed(value, 0 if size is None else 1)
        if size is not None:
            value = _mixed_text(_mixed(value, int(isinstance(size, str))), str(size))
    return ((value << 1) & _WORD) + (value >> 63) & _WORD


def _mixed(value: int, byte: int) -> int:
    signed = value - (1 << 64) if value >> 63 else value
    return ((value << 8) ^ (signed >> 55)) + byte & _WORD


def _mixed_text(value: int, text: str) -> int:
    value = _mixed(value, len(text))
    for byte in text.encode():
        value = _mixed(value, byte)
    return value


@cache
def _layout(struct_name: str, joints: int) -> np.dtype:
    fields: list[tuple[str, Any] | tuple[str, Any, tuple[int]]] = [("fingerprint", ">u8")]
    for name, kind, size in members(struct_name):
        count = joints if isinstance(size, str) else size
        fields.append((name, _KINDS[kind]) if count is None else (name, _KINDS[kind], (count,)))
    return np.dtype(fields)


def _packed(struct_name: str, joints: int, values: object) -> bytes:
    record = np.zeros((), _layout(struct_name, joints))
    record["fingerprint"], record["version"], record["num_joints"] = fingerprint(struct_name), VERSION, joints
    for name, _, _ in members(struct_name)[2:]:
        record[name] = getattr(values, name)
    return record.tobytes()


def _unpacked(what: str, joints: int, message: bytes) -> dict[str, Any]:
    layout = _layout(f"{what}_t", joints)
    if len(message) >= 16:
        mark, version, count = struct.unpack_from(">Qii", message)
        _check(what, mark, version)
        if count != joints:
            raise BadInput(f"wire: {what}: num_joints", str(joints), str(count))
    if len(message) != layout.itemsize:
        raise BadInput(f"wire: {what}", f"{layout.itemsize} bytes", str(len(message)))
    record = np.frombuffer(message, layout).astype(layout.newbyteorder("="))[0]  # all numbers turned at once
    named = members(f"{what}_t")[2:]
    return {name: record[name] if size is not None else record[name].item() for name, _, size in named}


def _check(what: str, mark: int, version: int) -> None:
    if mark != fingerprint(f"{what}_t"):
        raise BadInput(f"wire: {what}", "a message of bumblebee_wire.lcm", "one of another type on this channel")
    if version != VERSION:
        raise BadInput(f"wire: {what}: version", str(VERSION), str(version), "Install the same version on both sides.")


def _text(text: str) -> bytes:
    data = text.encode() + b"\0"
    return struct.pack(">i", len(data)) + data
