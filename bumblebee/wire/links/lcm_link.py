"""The wire `lcm`: UDP multicast by LCM, by default on this machine alone (time to live 0)."""

import select
from collections.abc import Sequence

from bumblebee.errors import BadInput
from bumblebee.wire.messages import CHANNELS

URL = "udpm://239.255.76.67:7667?ttl=0"


class LcmLink:
    """One end of the wire `lcm`; see `Link`."""

    def __init__(self, at: str, listen: Sequence[str]) -> None:
        try:
            import lcm
        except ModuleNotFoundError:
            do = "Use --robot sim, or in the checkout: pip install -e '.[wire]'"
            raise BadInput("--robot lcm", "the package lcm", "no module 'lcm'", do) from None
        try:
            self._lcm = lcm.LCM(at or URL)
        except RuntimeError as error:
            do = "Where loopback has no multicast: ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo"
            raise BadInput(f"lcm: {at or URL}", "a network with multicast", str(error)[:80], do) from None
        self._came: list[tuple[str, bytes]] = []
        for channel in (name for name in CHANNELS if name in listen):
            self._lcm.subscribe(channel, self._take).set_queue_capacity(256)

    def send(self, channel: str, message: bytes) -> None:
        """See `Link.send`."""
        self._lcm.publish(channel, message)

    def received(self) -> list[tuple[str, bytes]]:
        """See `Link.received`."""
        while self._lcm.handle_timeout(0):
            pass
        came, self._came = self._came, []
        return came

    def wait(self, seconds: float) -> None:
        """See `Link.wait`."""
        select.select([self._lcm.fileno()], [], [], max(0.0, seconds))

    def close(self) -> None:
        """See `Link.close`."""
        del self._lcm

    def _take(self, channel: str, message: bytes) -> None:
        self._came.append((channel, message))
