"""The process in which Prefect runs: `python -m flows.walk [--deployment NAME]`, started and watched by the keeper.

It walks the loop once, or serves it as a deployment. When Prefect's server goes away (the keeper says so with SIGUSR1)
the stages go on, and the process ends with them instead of asking a server that is not there.
"""

import argparse
import logging
import os
import signal
import sys
import warnings
from pathlib import Path
from typing import Any

from bumblebee.last_line import unforeseen
from flows import terminal
from flows import workspace as workspaces
from flows.owned import require_own
from tasks.running.parent import end_with_parent

EXIT_FAILED, EXIT_WAITING = 1, 3


def main(argv: list[str] | None = None) -> int:
    """Run; 0 done, 1 a stage failed, 3 a gate waits for an answer."""
    parser = argparse.ArgumentParser(prog="python -m flows.walk", description=__doc__)
    parser.add_argument("--deployment", default="", help="serve the loop under this name instead of walking it once")
    parser.add_argument("--verbose", action="store_true", help="show every line of every stage, not one a stage")
    options = parser.parse_args(argv)
    end_with_parent()
    if options.deployment:
        serve(options.deployment)
        return 0
    return walk(options.verbose)


def walk(verbose: bool = False) -> int:
    """Run the flow in this process; only now is Prefect imported, since it reads its settings once."""
    folder = Path(os.environ["BUMBLEBEE_WORKSPACE"])
    lost = Lost()
    signal.signal(signal.SIGUSR1, lost.say)  # before the slow import: unhandled it would end this process
    from flows import loop as loops

    loops.at_end = lambda state: lost.leave(verdict(state, loops.WAITING)) if lost else None
    os.chdir(folder)
    logging.getLogger("prefect.flow_runs").addFilter(without_trace)
    try:
        terminal.to_file(folder, verbose)
        state = loops.loop.with_options(task_runner=loops.runner(folder))(return_state=True)
    except Exception as error:  # of Prefect's own: what a stage or the flow raises is a state
        print(without_server(error, bool(lost)), file=sys.stderr)
        return EXIT_FAILED
    for logger in ("prefect", "prefect.flow_runs", "prefect.task_runs"):
        for handler in logging.getLogger(logger).handlers:
            handler.flush()  # what is on its way to the server must arrive before that ends
    return verdict(state, loops.WAITING)


def without_server(error: Exception, lost: bool) -> str:
    """One line for a run that Prefect could not begin or end."""
    again = "what completed is kept: the same command goes on from there"
    if lost or "Failed to reach API" in str(error):
        return f"Prefect's server went away before the run had begun or ended; {again}"
    if "500 Internal Server Error" in str(error):
        return f"Prefect's server could not keep how the run began or ended (its database is away?); {again}"
    return f"{unforeseen(error)}; {again}"


def verdict(state: Any, waiting: str) -> int:
    """The exit status of how the run ended, which is said if it is not done."""
    if state.is_completed():
        return 0
    print(state.message, file=sys.stderr)
    if state.name == waiting:
        return EXIT_WAITING
    print("what completed is kept: the same command goes on from there", file=sys.stderr)
    return EXIT_FAILED


def serve(name: str) -> None:
    """Wait for runs to start or resume, each in a process of its own."""
    require_own(Path(os.environ["BUMBLEBEE_WORKSPACE"]))
    os.chdir(workspaces.HOME)
    from flows.loop import loop

    logging.getLogger("prefect.runner").setLevel(logging.ERROR)
    warnings.simplefilter("ignore", RuntimeWarning)  # its end leaves a coroutine unawaited, and says so
    settings: dict[str, Any] = {"print_starting_message": False, "pause_on_shutdown": False}
    loop.serve(name=name, **settings)


class Lost:
    """Whether Prefect's server went away; from then on nothing is said but what the stages say."""

    def __init__(self) -> None:
        self.known = False

    def __bool__(self) -> bool:
        return self.known

    def say(self, number: int, frame: object) -> None:
        """Take the keeper's word for it."""
        self.known = True
        for name in ("", *logging.root.manager.loggerDict):
            for handler in logging.getLogger(name).handlers:
                handler.addFilter(of_a_stage)

    def leave(self, status: int) -> None:
        """End at once, with what would be Prefect's share left out."""
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def without_trace(record: logging.LogRecord) -> bool:
    """Take the traceback off a line about Prefect's own server: `without_server` says what it means."""
    error = record.exc_info[1] if record.exc_info else None
    if type(error).__name__ == "PrefectHTTPStatusError":
        record.exc_info = record.exc_text = None
    return True


def of_a_stage(record: logging.LogRecord) -> bool:
    """Whether a line of the log is a stage's own."""
    return record.name == "prefect.task_runs" and record.exc_info is None and record.levelno <= terminal.NOTICE


if __name__ == "__main__":
    raise SystemExit(main())
