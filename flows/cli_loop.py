"""Command line of the loop: `bumblebee demo`, `serve`, `report`, `fetch`; modules are imported when they are called."""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from bumblebee.commands.view import PORT, Meshes, Port, Ticks, play_shipped_policy
from bumblebee.errors import BadInput

Name = Annotated[str, typer.Option("--name", help="Workspace under runs/; without, the checkout itself.")]
PrefectPort = Annotated[int, typer.Option("--prefect-port", help="Port of Prefect's server; 0: a free one.")]
Workspace = Annotated[Path | None, typer.Option("--workspace", help="An existing workspace, as it is.")]
Approved = Annotated[bool, typer.Option("--approved", help="Only what people approved where asked; says who did.")]
MlflowPort = Annotated[int, typer.Option("--mlflow-port", help="Port of MLflow's server; 0: a free one.")]


def demo(
    context: typer.Context,
    view: Annotated[bool, typer.Option("--view", help="Play the shipped policy in the browser.")] = False,
    motions: Annotated[Path | None, typer.Option("--motions", help="Motion files, not the embedded ones.")] = None,
    name: Annotated[str, typer.Option("--name", help="Workspace under runs/; by default after --motions.")] = "",
    workspace: Workspace = None,
    profile: Annotated[str, typer.Option("--profile", help="File of profiles/ on top of params.yaml.")] = "",
    seed: Annotated[str, typer.Option("--seed", help="Seed of the sealed robot, or `null`: it lacks nothing.")] = "",
    robot: Annotated[str, typer.Option("--robot", help="A robot's folder, or a name of `robot list`.")] = "",
    policy: Annotated[Path | None, typer.Option("--policy", help="A policy of yours to begin from, a folder.")] = None,
    verbose: Annotated[bool, typer.Option("--verbose", help="Show every line of every stage.")] = False,
    prefect_port: PrefectPort = 0,
    mlflow_port: MlflowPort = 0,
    port: Port = PORT,
    meshes: Meshes = None,
    ticks: Ticks = None,
) -> None:
    """Run the whole loop, as `make demo` does; status 3: a gate waits for an answer."""
    if view:
        play_shipped_policy(port, meshes, ticks)
        return
    require_checkout("demo")
    from bumblebee.last_line import guarded
    from flows.demo import started

    options = {
        "motions": motions,
        "name": name,
        "workspace": workspace,
        "profile": profile,
        "seed": seed,
        "policy": policy,
        "robot": robot or context.find_root().params.get("robot", ""),
    }
    more = {"prefect_port": prefect_port, "mlflow_port": mlflow_port, "verbose": verbose}
    raise typer.Exit(guarded(lambda: started(argparse.Namespace(**options, **more))))


def serve(
    name: Name = "", workspace: Workspace = None, prefect_port: PrefectPort = 0, mlflow_port: MlflowPort = 0
) -> None:
    """Open Prefect and MLflow on loopback until Ctrl-C, as `make serve` does."""
    require_checkout("serve")
    from bumblebee.last_line import guarded
    from flows.servers.serve import started

    both = {"prefect_port": prefect_port, "mlflow_port": mlflow_port}
    raise typer.Exit(guarded(lambda: started(argparse.Namespace(name=name, workspace=workspace, **both))))


def report(name: Name = "") -> None:
    """Write the report of a loop that has run, and say where it is."""
    require_checkout("report")
    from flows.environment import environment
    from flows.workspace import named
    from tasks.running import paths

    folder = named(name)
    if not (folder / paths.PUBLISHED).exists():
        do = f"Run `bumblebee demo{f' --name {name}' if name else ''}` first."
        raise BadInput(folder / paths.PUBLISHED, "results of a loop that has run", "none", do)
    command = [sys.executable, "-m", "tasks.report"]
    status = subprocess.run(command, cwd=folder, env=environment(folder), check=False).returncode
    if status == 0:
        print(f"open {folder / paths.REPORT}")
    raise typer.Exit(status)


def fetch(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="NAME@ALIAS or NAME/VERSION: expert-c0@champion.")],
    out: Annotated[Path, typer.Option("--out", help="A new folder for the policy.")],
    workspace: Annotated[Path, typer.Option("--workspace", help="Folder with .servers; by default this one.")] = Path(),
    server: Annotated[str, typer.Option("--server", help="MLflow's address, in place of a workspace.")] = "",
    approved: Approved = False,
) -> None:
    """Copy a registered policy with its card and lineage; no server needs to run."""
    from tasks.policies.fetch import main

    options = ["--out", str(out), "--workspace", str(workspace), *(["--server", server] if server else [])]
    options += ["--approved"] if approved else []
    raise typer.Exit(main([model, *options]))


def require_checkout(command: str) -> None:
    """Refuse an installation without the files that the loop is made of.

    Raises:
        BadInput: no dvc.yaml beside the packages.
    """
    import bumblebee

    home = Path(bumblebee.__file__).resolve().parent.parent
    if not (home / "dvc.yaml").exists():
        do = "Get the source, run `make setup` in it, then `.venv/bin/bumblebee` from there."
        raise BadInput(f"bumblebee {command}", "a checkout of BumbleBee, with dvc.yaml", f"none at {home}", do)
