"""Starts the operator's page beside a run, in a process of its own, and gives the console's end of its line."""

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.wire.links import packets
from bumblebee.wire.operator.watcher import Watcher

SERVER = "flows.servers.operator_server"
"""Module that serves it behind the login of the workspace's pages; as text, since the library imports no flows."""
_PATIENCE = 5.0  # s for its end


@contextmanager
def operator_page(port: int, workspace: Path, say: Callable[[str], None]) -> Iterator[Watcher]:
    """The page, until the run is over; `say` is told its address and where the password stands.

    Raises:
        BadInput: it does not start; nothing has moved yet.
    """
    ours, theirs = packets.pair()
    words = [sys.executable, "-m", SERVER, "--workspace", str(workspace), "--port", str(port)]
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(
            [*words, "--console", str(theirs.fileno())],
            pass_fds=(theirs.fileno(),),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=errors,
            start_new_session=True,
            text=True,
        )
        theirs.close()
        try:
            assert process.stdout is not None
            if not (url := process.stdout.readline().strip()):
                process.wait()
                errors.seek(0)
                came = (errors.read().strip().splitlines() or [f"status {process.returncode}"])[-1]
                do = "Run it without --page, or see `bumblebee doctor`."
                raise BadInput("--page", "a page that starts", came, do)
            say(f"page: {url}, user and password in {workspace.resolve() / '.servers' / 'login'}")
            yield Watcher(ours)
        finally:
            ours.close()
            with suppress(subprocess.TimeoutExpired):
                process.wait(_PATIENCE)
            process.kill()
            process.wait()
