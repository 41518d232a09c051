"""The wire `sim`: datagram sockets in a folder that only this user may enter, one a process.

A socket's name begins with the letters of the channels that it listens to, so that whoever sends finds its listeners.
"""

import os
import secrets
import select
import socket
import stat
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.wire.messages import CHANNELS

_LETTERS = dict(zip(CHANNELS, "SOC", strict=True))
_NAMES = {letter: channel for channel, letter in _LETTERS.items()}
_LOOK = 0.2  # s between two looks for sockets that came
_MOST = 1 << 16  # bytes of a message


class SocketLink:
    """One end of the wire `sim`; see `Link`."""

    def __init__(self, at: str, listen: Sequence[str]) -> None:
        self._folder = Path(at) if at else Path(tempfile.gettempdir()) / f"bumblebee-wire-{os.getuid()}"
        _own_folder(self._folder)
        letters = "".join(_LETTERS[channel] for channel in listen)
        self._path = self._folder / f"{letters}-{os.getpid()}-{secrets.token_hex(4)}"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        try:
            self._socket.bind(str(self._path))
        except OSError as error:  # a path of more than 107 bytes, most of all
            raise BadInput(self._folder, "a folder for sockets", str(error)[:80], "Give a shorter path.") from None
        self._others: list[tuple[str, str]] = []
        self._looked = -_LOOK

    def send(self, channel: str, message: bytes) -> None:
        """See `Link.send`."""
        letter = _LETTERS[channel]
        for letters, path in self._listeners():
            if letter in letters:
                try:
                    self._socket.sendto(letter.encode() + message, path)
                except BlockingIOError:
                    continue
                except (ConnectionRefusedError, FileNotFoundError):  # its process is gone
                    self._looked = -_LOOK
                    with suppress(FileNotFoundError):
                        os.unlink(path)

    def received(self) -> list[tuple[str, bytes]]:
        """See `Link.received`."""
        found = []
        with suppress(BlockingIOError):
            while True:
                data = self._socket.recv(_MOST)
                if channel := _NAMES.get(data[:1].decode("latin-1")):
                    found.append((channel, data[1:]))
        return found

    def wait(self, seconds: float) -> None:
        """See `Link.wait`."""
        select.select([self._socket], [], [], max(0.0, seconds))

    def close(self) -> None:
        """See `Link.close`."""
        self._socket.close()
        self._path.unlink(missing_ok=True)

    def _listeners(self) -> list[tuple[str, str]]:
        """Letters and path of every other socket in the folder."""
        now = time.monotonic()
        if now - self._looked >= _LOOK:
            self._looked, own = now, self._path.name
            sockets = (path for path in self._folder.iterdir() if path.name != own and path.is_socket())
            self._others = [(path.name.partition("-")[0], str(path)) for path in sockets]
        return self._others


def _own_folder(folder: Path) -> None:
    """Make the folder, or refuse one that somebody else can enter."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise BadInput(folder, "a folder for sockets", error.strerror or "none", "Choose another with --at.") from None
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise BadInput(folder, "a folder that only you may enter", "one open to others", f"chmod 700 {folder}")
