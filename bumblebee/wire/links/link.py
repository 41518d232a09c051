"""Wires: the ways that a message goes from one process to all others that listen on its channel."""

from collections.abc import Sequence
from typing import Protocol

from bumblebee.errors import BadInput

WIRES = ("sim", "lcm", "unitree")
"""`sim`: sockets of this machine, nothing to install; `lcm`: UDP multicast, the package lcm; `unitree`: the vendor's
messages over DDS, the package cyclonedds."""


class Link(Protocol):
    """One process's end of a wire."""

    def send(self, channel: str, message: bytes) -> None:
        """Send a message to whoever listens now; one that a listener has no room for is lost to it."""

    def received(self) -> list[tuple[str, bytes]]:
        """Channel and bytes of all messages since the last call, the oldest first; does not wait."""

    def wait(self, seconds: float) -> None:
        """Return when a message has arrived, or after `seconds`."""

    def close(self) -> None:
        """Leave the wire."""


def open_link(wire: str, listen: Sequence[str], at: str = "") -> Link:
    """Open one end of a wire.

    Args:
        wire: one of `WIRES`.
        listen: channels to listen to.
        at: address, `""` for the usual one: a folder for `sim`, an LCM URL for `lcm`, `dds://ADDRESS?kp=...&kd=...` for
            `unitree`.

    Raises:
        BadInput: no such wire, no such address, or a package that is missing.
    """
    if wire == "sim":
        from bumblebee.wire.links.socket_link import SocketLink

        return SocketLink(at, listen)
    if wire == "lcm":
        from bumblebee.wire.links.lcm_link import LcmLink

        return LcmLink(at, listen)
    if wire == "unitree":
        from bumblebee.wire.links.unitree_link import UnitreeLink

        return UnitreeLink(at, listen)
    raise BadInput("--robot", " or ".join(WIRES), repr(wire)[:40])
