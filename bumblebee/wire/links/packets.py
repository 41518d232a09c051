"""Packets between processes of this machine: sockets that keep messages whole and say when the other side is gone."""

import socket
from contextlib import suppress

_ROOM = 1 << 20  # bytes under way
_MOST = 1 << 18  # bytes of a packet


class Gone(Exception):
    """The process on the other side has ended."""


def pair() -> tuple[socket.socket, socket.socket]:
    """Two connected ends."""
    ends = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for end in ends:
        ready(end)
    return ends


def ready(end: socket.socket) -> None:
    """Make an end non-blocking, with room for a second of records."""
    end.setblocking(False)
    for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
        end.setsockopt(socket.SOL_SOCKET, option, _ROOM)


def send(end: socket.socket, message: bytes) -> bool:
    """Send a packet; False where there is no room, Gone where nobody reads any more."""
    try:
        end.send(message)
    except BlockingIOError:
        return False
    except (BrokenPipeError, ConnectionResetError):
        raise Gone from None
    return True


def received(end: socket.socket) -> list[bytes]:
    """Packets that have come, the oldest first; does not wait.

    Raises:
        Gone: nothing has come and nothing will.
    """
    found: list[bytes] = []
    with suppress(BlockingIOError):
        while True:
            try:
                message = end.recv(_MOST)
            except ConnectionResetError:  # said once, before what is still to be read: it left some of ours unread
                continue
            if not message:
                if found:
                    return found
                raise Gone
            found.append(message)
    return found
