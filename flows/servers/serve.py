"""`make serve`: both servers open until Ctrl-C, and the loop as a deployment that Prefect's pages start and resume.

With a section `serve` in `lab.yaml` for people from elsewhere, too, each with a login of their own.
"""

import argparse
import os
import sys
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from flows import workspace as workspaces
from flows.attend import attend, ended_in_order
from flows.demo import add_ports, announce
from flows.environment import environment
from flows.gates import gate_answer
from flows.owned import require_own
from flows.servers.first_look import MODELS
from flows.servers.servers import Addresses, require_port, servers
from tasks.lab.private import private_index
from tasks.lab.serve import read_serve

DEPLOYMENT = "demo"


def main(argv: list[str] | None = None) -> int:
    """Serve until Ctrl-C, SIGTERM or SIGHUP; 0 then, 1 when Prefect's server went away, 2 bad input."""
    options = parser().parse_args(argv)
    return guarded(lambda: started(options))


def started(options: argparse.Namespace) -> int:
    """Open both servers, with the loop as a deployment, until a signal comes."""
    with ended_in_order():
        try:
            require_port("--prefect-port", options.prefect_port)
            require_port("--mlflow-port", options.mlflow_port)
            folder = options.workspace or workspaces.named(options.name)
            require_own(folder)
            private_index(folder)
            os.environ.update(environment(folder))
            door = read_serve(folder)
            with servers(folder, options.prefect_port, options.mlflow_port, door) as addresses:
                announce(folder, addresses)
                if door is not None:
                    pages = f"{door.prefect} and {door.mlflow}/{MODELS}"
                    print(f"people     {pages}, each with a login of their own", flush=True)
                try:
                    gate_answer.resume_answered(folder, addresses.prefect)
                except (BadInput, OSError) as error:  # a gate's file, or the server: the pages are open all the same
                    print(f"runs that were answered meanwhile still wait: {error}", file=sys.stderr)
                return serve(folder, addresses)
        except KeyboardInterrupt:
            print("servers stopped", file=sys.stderr)
            return 0


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(prog="python -m flows.servers.serve", description=__doc__)
    made.add_argument("--name", default="", help="workspace under runs/; by default the checkout itself")
    made.add_argument("--workspace", type=Path, help="an existing workspace anywhere, as it is")
    add_ports(made)
    return made


def serve(folder: Path, addresses: Addresses) -> int:
    """Wait for runs to start or resume, each in a process of its own; ends with Ctrl-C."""
    if addresses.keeper != os.getpid():
        print(f"the servers already run; they end with process {addresses.keeper}", flush=True)
    print("start a run on Prefect's page Deployments; Ctrl-C ends this", flush=True)
    return attend(folder, addresses, "--deployment", DEPLOYMENT, until_lost=True)


if __name__ == "__main__":
    raise SystemExit(main())
