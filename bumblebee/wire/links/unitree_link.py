"""The wire `unitree`: rt/lowcmd and rt/lowstate of Unitree's G1 over CycloneDDS 0.10, the vendor's own version.

The bytes of a message are those of its record: a class of the library's is made for its type, and is handed bytes.
"""

import time
import types
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.wire.clock import SECOND
from bumblebee.wire.links.unitree_ends import ControllerEnd, RobotEnd
from bumblebee.wire.links.unitree_hg import LOW_CMD, LOW_STATE, as_cdr, from_cdr
from bumblebee.wire.messages import CARD, ORDER, STATE
from bumblebee.wire.robot_end.hearing import RELEASE

URL = "dds://127.0.0.1?kp=40&kd=1"
_TYPES = {"motor_cmd": "MotorCmd_", "motor_state": "MotorState_", "imu_state": "IMUState_"}
_SCALARS = {"u1": "uint8", "i2": "int16", "u4": "uint32", "f4": "float32"}
_KEPT = 64  # messages that a reader keeps


@dataclass(frozen=True)
class Address:
    """Parts of `dds://ADDRESS?domain=0&kp=...&kd=...`."""

    host: str
    """Address of this machine on the robot's network."""
    domain: int
    wrists: tuple[float, float] | None
    """kp [N m/rad] and kd [N m s/rad] of the wrists; None where they are not given."""

    @property
    def config(self) -> str:
        """Settings for CycloneDDS; loopback has no multicast, so there its own address is asked."""
        local = self.host.startswith("127.")
        peers = f'<Peers><Peer Address="{self.host}"/></Peers>' if local else ""
        index = "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>"
        return (
            '<CycloneDDS><Domain Id="any"><General>'
            f'<Interfaces><NetworkInterface address="{self.host}"/></Interfaces>'
            f"<AllowMulticast>{'false' if local else 'default'}</AllowMulticast></General>"
            f"<Discovery>{index}{peers}</Discovery></Domain></CycloneDDS>"
        )


def read_address(at: str) -> Address:
    """Address from the text of `--at`, `""` for loopback; BadInput for another text."""
    try:
        parts = urlsplit(at or "dds://127.0.0.1")
        query = dict(parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query)))
        domain = int(query.pop("domain", "0"))
        wrists = (float(query.pop("kp")), float(query.pop("kd"))) if query else None
        if parts.scheme != "dds" or not parts.hostname or query or not all(0 <= gain < 1e4 for gain in wrists or ()):
            raise ValueError
    except (ValueError, KeyError):
        raise BadInput("--at", f"an address as {URL}", repr(at)[:60]) from None
    return Address(parts.hostname, domain, wrists)


class UnitreeLink:
    """One end of the wire `unitree`; see `Link`. Who listens to orders is the robot's end."""

    def __init__(self, at: str, listen: Sequence[str]) -> None:
        address = read_address(at)
        self._is_robot, self._meets = ORDER in listen, CARD in listen
        if address.wrists is None and not self._is_robot:
            do = f"Give your robot's: --at '{URL}'"
            raise BadInput("--at", "kp and kd that hold the wrists, which the policy does not move", "none", do)
        try:
            from cyclonedds.core import Listener, Policy, Qos, ReadCondition, SampleState, WaitSet
            from cyclonedds.domain import DomainParticipant
            from cyclonedds.pub import DataWriter
            from cyclonedds.sub import DataReader
            from cyclonedds.topic import Topic
        except ImportError as error:
            do = "Use --robot sim, or build it as docs/deploy.md says: pip install -e '.[unitree]'"
            raise BadInput("--robot unitree", "the package cyclonedds", str(error)[:80], do) from None
        self._domain = _domain(address.domain, address.config)
        participant = DomainParticipant(address.domain)
        names = ("rt/lowcmd", "rt/lowstate")
        topics = [Topic(participant, name, kind) for name, kind in zip(names, _kinds(), strict=True)]
        others = Qos(Policy.History.KeepLast(_KEPT), Policy.IgnoreLocal.Participant)
        self._orders, self._states = (DataReader(participant, topic, others) for topic in topics)
        self._readers = 0
        listener = Listener(on_publication_matched=self._matched)
        self._writer = DataWriter(participant, topics[self._is_robot], listener=listener)
        self._wakes = WaitSet(participant)
        condition = ReadCondition(self._orders if self._is_robot else self._states, SampleState.NotRead)
        self._wakes.attach(condition)
        self._participant, self._condition = participant, condition
        self._since = 0
        self._robot, self._controller = RobotEnd(), ControllerEnd(*address.wrists or (0.0, 0.0))

    def send(self, channel: str, message: bytes) -> None:
        """See `Link.send`; a card is not sent, since LowState_ says who it is."""
        if channel == CARD:
            return
        record = self._robot.state(message) if channel == STATE else self._controller.order(message)
        if record is not None:
            self._writer.write(_kinds()[self._is_robot].of(record))

    def received(self) -> list[tuple[str, bytes]]:
        """See `Link.received`."""
        now, found = time.monotonic_ns(), list[tuple[str, bytes]]()
        orders = _taken(self._orders)
        if self._is_robot:
            return [(ORDER, self._robot.order(*one)) for one in _checked(orders, LOW_CMD)]
        if orders:
            self._controller.another(now)
        for record, writer in _checked(_taken(self._states), LOW_STATE):
            try:
                state, card = self._controller.state(record, writer, now, self._readers > 0)
            except BadInput:
                if self._meets:
                    raise
                continue
            self._since = self._since or now
            if not self._meets:
                found.append((STATE, state))
            elif now - self._since > RELEASE * SECOND:  # another controller has been heard by now
                found += [(CARD, card), (STATE, state)]
        return found

    def wait(self, seconds: float) -> None:
        """See `Link.wait`."""
        self._wakes.wait(round(max(0.0, seconds) * 1e9))

    def close(self) -> None:
        """See `Link.close`."""
        del self._wakes, self._condition, self._orders, self._states, self._writer, self._participant

    def _matched(self, writer: Any, status: Any) -> None:
        self._readers = status.current_count


def _taken(reader: Any) -> list[tuple[bytes, int]]:
    """Bodies and writers of all messages that came, the oldest first."""
    came = reader.take(_KEPT)
    return [(one.body, one.sample_info.publication_handle) for one in came if hasattr(one, "body")]


def _checked(came: Sequence[tuple[bytes, int]], layout: np.dtype) -> list[tuple[np.ndarray, int]]:
    """Messages that are whole; a robot drops the others as well."""
    found = []
    for body, writer in came:
        try:
            found.append((from_cdr(body, layout), writer))
        except BadInput:
            continue
    return found


@cache
def _domain(number: int, config: str) -> Any:
    from cyclonedds.domain import Domain

    return Domain(number, config)


@cache
def _kinds() -> tuple[Any, Any]:
    """The library's classes for LowCmd_ and LowState_."""
    return _kind("LowCmd_", LOW_CMD), _kind("LowState_", LOW_STATE)


def _kind(name: str, layout: np.dtype) -> Any:
    """Class of a message whose samples are bodies of bytes, with the members of its record."""
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl import types as idl
    from cyclonedds.idl.annotations import autoid, final

    hints: dict[str, Any] = {}
    array: Any = idl.array
    for field in (name for name in layout.names or () if name != "pad"):
        one = layout[field]
        base = one.base
        kind = _kind(_TYPES[field], base) if base.names else getattr(idl, _SCALARS[base.str[1:]])
        hints[field] = array[kind, one.shape[0]] if one.shape else kind

    def serialize(self: Any, *_: Any, use_version_2: bool = False, **__: Any) -> bytes:
        return (b"\0\7\0\0" if use_version_2 else b"\0\1\0\0") + self.body

    def fill(space: dict[str, Any]) -> None:
        space["__annotations__"].update(hints)
        space |= {"serialize": serialize, "deserialize": classmethod(lambda cls, data, *_, **__: _made(cls, data[4:]))}
        space |= {"deserialize_key": classmethod(lambda cls, *_, **__: None)}
        space["of"] = classmethod(lambda cls, record: _made(cls, as_cdr(record)))

    made = types.new_class(name, (IdlStruct,), {"typename": f"unitree_hg.msg.dds_.{name}"}, fill)
    return autoid("sequential")(final(made))


def _made(kind: Any, body: bytes) -> Any:
    made = kind.__new__(kind)
    made.body = bytes(body)
    return made
