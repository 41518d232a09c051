"""Copies a registered policy out of a workspace's own store without a server, or from a lab's server.

    python -m tasks.policies.fetch expert-c0@champion --out policy [--workspace runs/demo]
    python -m tasks.policies.fetch expert-c0/2 --out policy
    python -m tasks.policies.fetch expert-c0@champion --out policy --server https://data.lab:5000

The folder then holds policy.onnx, contract.json, card.json, README.md (the model card) and lineage.json.
"""

import argparse
import os
import re
import sys
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from tasks import registry
from tasks.approvals.promotion.approved import let_through
from tasks.lab.serve import require_server


def main(argv: list[str] | None = None) -> int:
    """Copy one version; returns the exit status."""
    return guarded(lambda: _fetch(_options(argv)))


def _fetch(options: argparse.Namespace) -> int:
    named = re.fullmatch(r"([^@/]+)(?:@([^@/]+)|/(\d+))", options.model)
    if named is None:
        raise BadInput("model", "<name>@<alias> or <name>/<version>", options.model, "Such as expert-c0@champion.")
    if not options.workspace.is_dir():
        raise BadInput(options.workspace, "a workspace", "no folder", registry.NO_WORKSPACE)
    server = require_server(options.server, "--server") if options.server else ""
    out = options.out.absolute()
    os.chdir(options.workspace)  # the store is the workspace's
    if options.approved and server:
        raise BadInput("--approved", "a workspace, where answers of people lie", "--server", "Give --workspace.")
    told: list[str] = []

    def check(files: Path) -> None:
        if options.approved:
            told.append(let_through(named[1], files / "policy.onnx", Path.cwd()))

    print(registry.fetch(named[1], named[2] or named[3], out, server, check), *told, sep="\n")
    return 0


def _options(argv: list[str] | None) -> argparse.Namespace:
    made = argparse.ArgumentParser(prog="python -m tasks.policies.fetch", description=(__doc__ or "").splitlines()[0])
    made.add_argument("model", help="<name>@<alias> or <name>/<version>, such as expert-c0@champion")
    made.add_argument("--out", type=Path, required=True, help="a new folder for the policy")
    made.add_argument("--workspace", type=Path, default=Path("."), help="folder with .servers (default: this one)")
    made.add_argument("--server", default="", help="address of MLflow's server, instead of a workspace's store")
    made.add_argument(
        "--approved", action="store_true", help="only what people approved where they were asked; says who"
    )
    return made.parse_args(argv)


if __name__ == "__main__":
    sys.exit(main())
