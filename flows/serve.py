"""`make serve`: both servers open until Ctrl-C, and the loop as a deployment that Prefect's pages start and resume."""

import argparse
import os
import signal
import sys
from pathlib import Path
from typing import Any

from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from flows import workspace as workspaces
from flows.demo import add_ports, announce
from flows.environment import environment
from flows.servers import Addresses, servers

DEPLOYMENT = "demo"


def main(argv: list[str] | None = None) -> int:
    """Serve until Ctrl-C or SIGTERM."""
    options = parser().parse_args(argv)
    signal.signal(signal.SIGTERM, _as_interrupt)
    try:
        folder = workspaces.named(options.name)
        os.environ.update(environment(folder))
        with servers(folder, options.prefect_port, options.mlflow_port) as addresses:
            announce(folder, addresses)
            serve(folder, addresses)
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        pass
    print("servers stopped", file=sys.stderr)
    return 0


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(prog="python -m flows.serve", description=__doc__)
    made.add_argument("--name", default="", help="workspace under runs/; by default the checkout itself")
    add_ports(made)
    return made


def serve(folder: Path, addresses: Addresses) -> None:
    """Wait for runs to start or resume, each in a process of its own; ends with Ctrl-C."""
    os.environ["PREFECT_API_URL"] = f"{addresses.prefect}/api"
    os.environ["BUMBLEBEE_WORKSPACE"] = str(folder)
    os.chdir(workspaces.HOME)
    from flows.loop import loop

    print("start a run on Prefect's page Deployments; Ctrl-C ends the servers", flush=True)
    settings: dict[str, Any] = {"print_starting_message": False, "pause_on_shutdown": False}
    loop.serve(name=DEPLOYMENT, parameters={"workspace": str(folder)}, **settings)


def _as_interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    raise SystemExit(main())
