"""`dvc --wait-for-lock repro -s STAGE` in a process that ends with the flow: `python -m flows.reproduce STAGE`."""

import signal
import sys
from pathlib import Path

if __name__ == "__main__" and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while DVC is imported, Ctrl-C ends it without a word

from flows.servers.rwlock import clear_cut_off
from tasks.running import lock_file
from tasks.running.parent import end_with_parent


def main(argv: list[str] | None = None) -> int:
    """Bring the named stages up to date; DVC's exit status."""
    end_with_parent()
    from dvc.cli import main as dvc

    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    lock_file.read_whole()
    clear_cut_off(Path.cwd())
    names = sys.argv[1:] if argv is None else argv
    # Waiting for the lock matters: of stages that run side by side one would otherwise lose its finished work.
    return int(dvc(["--wait-for-lock", "repro", "--single-item", *names]))


if __name__ == "__main__":
    raise SystemExit(main())
