"""`make demo` and `make smoke`: the whole loop with both servers, in this checkout or in a workspace under runs/."""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.last_line import EXIT_INTERRUPTED, guarded
from flows import terminal
from flows import workspace as workspaces
from flows.attend import attend, ended_in_order
from flows.ending import login_of, registry, serve, shown, summarise
from flows.environment import environment
from flows.gpus import require as require_gpus
from flows.owned import require_own
from flows.servers.servers import Addresses, require_port, servers
from flows.stages import changed_stages, read_stages, to_run
from tasks import sections
from tasks.lab.private import private_index
from tasks.lab.servers import on_cluster
from tasks.settings import params

EXIT_WAITING = 3
NULL = "null"  # the seed of a robot without undeclared effects


def main(argv: list[str] | None = None) -> int:
    """Run; 0 done, 1 a stage failed, 2 bad input, 3 a gate waits for an answer, 130 ended by Ctrl-C or a signal."""
    options = parser().parse_args(argv)
    return guarded(lambda: started(options))


def started(options: argparse.Namespace) -> int:
    """Do what the options ask for, until it is done or a signal ends it."""
    with ended_in_order():
        try:
            require_port("--prefect-port", options.prefect_port)
            require_port("--mlflow-port", options.mlflow_port)
            return run(folder_of(options), options.prefect_port, options.mlflow_port, options.verbose)
        except KeyboardInterrupt:
            print("stopped; the same command continues after the last finished stage", file=sys.stderr)
            return EXIT_INTERRUPTED


def folder_of(options: argparse.Namespace) -> Path:
    """The workspace that the options name, or ask for.

    Raises:
        BadInput: `--workspace` with an option that would change it.
    """
    asked = (options.name, options.profile, options.motions, options.seed, options.robot, options.policy)
    if options.workspace is None:
        return choose(*asked)
    if any(asked):
        names = ("--name", "--profile", "--motions", "--seed", "--robot", "--policy")
        came = ", ".join(name for name, value in zip(names, asked, strict=True) if value)
        do = f"Leave one out, or change {options.workspace / 'params.yaml'}."
        raise BadInput("--workspace", "a workspace as it is", f"{came} beside it", do)
    return Path(options.workspace)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(prog="python -m flows.demo", description=__doc__)
    made.add_argument("--motions", type=Path, help="folder of motion files instead of the embedded ones")
    made.add_argument("--name", default="", help="workspace under runs/; by default after the motions' folder")
    made.add_argument("--workspace", type=Path, help="an existing workspace anywhere, as it is")
    made.add_argument("--profile", default="", help="file of profiles/ whose values replace those of params.yaml")
    made.add_argument("--seed", default="", help="seed of the robot that is sealed, or `null`: nothing undeclared")
    made.add_argument("--robot", default="", help="robot's folder, or one of `bumblebee robot list`")
    made.add_argument("--policy", type=Path, help="folder of a policy of yours to begin from")
    made.add_argument("--verbose", action="store_true", help="show every line of every stage, not one a stage")
    add_ports(made)
    return made


def add_ports(made: argparse.ArgumentParser) -> None:
    """The options of both servers' ports."""
    made.add_argument("--prefect-port", type=int, default=0, help="port of Prefect's server (default: a free one)")
    made.add_argument("--mlflow-port", type=int, default=0, help="port of MLflow's server (default: a free one)")


def choose(
    name: str, profile: str, motions: Path | None, seed: str = "", robot: str = "", policy: Path | None = None
) -> Path:
    """The checkout itself, or the workspace that the options ask for, made or brought up to date."""
    if not (name or profile or motions or seed or robot or policy):
        return workspaces.HOME
    sealed = robot_of(seed)
    if motions is not None and not name:
        name = motions.expanduser().resolve().name
    name = name or profile or (f"seed-{seed}" if seed else Path(robot or policy or "").name)
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", name)
    return workspaces.create(workspaces.HOME / "runs" / name, profile or None, motions, robot, policy, **sealed)


def robot_of(seed: str) -> dict[str, dict[str, int]]:
    """The section `seal` that a seed asks for; `null` is the robot as it is declared.

    Raises:
        BadInput: for anything but a whole number or `null`.
    """
    if not seed:
        return {}
    if seed == NULL:
        return {"seal": {"n_effects": 0}}
    if not re.fullmatch("[0-9]{1,9}", seed):
        raise BadInput("--seed", f"a number from 0 to 999999999, or {NULL}", seed[:80])
    return {"seal": {"seed": int(seed)}}


def run(folder: Path, prefect_port: int = 0, mlflow_port: int = 0, verbose: bool = False) -> int:
    """Bring the workspace up to date through the flow."""
    require_own(folder)
    private_index(folder)
    os.environ.update(environment(folder))
    params.check_names(params.read(folder / "params.yaml"), folder / "params.yaml")
    sections.loop(folder / "params.yaml")
    busy = to_run(read_stages(folder), changed_stages(folder))
    if not busy:
        print(f"everything in {shown(folder)} is up to date")
        summarise(folder)
        return 0
    if not on_cluster(folder):
        require_gpus(folder, busy)
    check = start_check(folder)
    check_cluster(folder)
    with servers(folder, prefect_port, mlflow_port) as addresses:
        finish_check(check)
        announce(folder, addresses)
        print(f"log        {shown(folder / terminal.FILE)}   every line of every stage", flush=True)
        status = attend(folder, addresses, *(["--verbose"] if verbose else []))
    if status == 0:
        summarise(folder)
    return status


def start_check(folder: Path) -> "subprocess.Popen[str]":
    """Begin to check every section of params.yaml while the servers start, before the first stage.

    A slip in the last section must not cost the time of the stages before it.
    """
    command = [sys.executable, "-m", "tasks.sections"]
    return subprocess.Popen(
        command, cwd=folder, env=environment(folder), text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )


def check_cluster(folder: Path) -> None:
    """Look at the lab's Ray cluster, where there is one, in a process that does not stay its client."""
    if on_cluster(folder):
        command = [sys.executable, "-m", "flows.cluster.ray_cluster"]
        if status := subprocess.run(command, cwd=folder, env=environment(folder), check=False).returncode:
            raise SystemExit(status)


def finish_check(check: "subprocess.Popen[str]") -> None:
    """Wait for the check; what it found ends the program."""
    _, said = check.communicate()
    if check.returncode == EXIT_BAD_INPUT:
        print(said.strip(), file=sys.stderr)
        raise SystemExit(EXIT_BAD_INPUT)
    if check.returncode:
        raise RuntimeError(said)


def announce(folder: Path, addresses: Addresses) -> None:
    """Where to look while it runs."""
    print(f"workspace  {shown(folder)}")
    print(f"Prefect    {addresses.prefect}   the stages as they run, and the gates")
    print(f"MLflow     {registry(addresses.mlflow)}   the registered policies, and every run's numbers")
    print(f"login      {login_of(folder)}")
    print(f"open them again with: {serve(folder)}", flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
