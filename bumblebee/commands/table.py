"""The table of all commands of `bumblebee`: each is imported when it is called, so that the help starts fast.

Commands of the upper floors (`tasks`, `flows`) stand here as text alone: the library imports neither.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from bumblebee.errors import BadInput


@dataclass(frozen=True)
class Command:
    """One command."""

    name: str
    target: str
    """`module:name` of a function or of a `typer.Typer`."""
    says: str
    """Purpose in a few words."""


LOOK, TRAIN, MEASURE, LAB = "Look", "Train", "Measure", "Run the loop and a lab"
TABLE: dict[str, tuple[Command, ...]] = {
    LOOK: (
        Command("motions", "bumblebee.commands.motions:app", "Inspect, convert, retarget and play motions."),
        Command(
            "view", "bumblebee.commands.view:view", "Show motions, a policy live, or measured rollouts in the browser."
        ),
        Command("robot", "bumblebee.commands.robot:app", "Print a model's joints; make and check a robot's folder."),
        Command("doctor", "bumblebee.commands.doctor:doctor", "Say what this machine lacks, each with a remedy."),
        Command("settings", "flows.cli_settings:settings", "Print every key of params.yaml with its meaning."),
    ),
    TRAIN: (
        Command("train", "bumblebee.commands.train:train", "Train a policy on a folder of motions."),
        Command("evaluate", "bumblebee.commands.evaluate:evaluate", "Try a policy on motions: success and errors."),
        Command("fetch", "flows.cli_loop:fetch", "Copy a registered policy out of a workspace or a server."),
    ),
    MEASURE: (
        Command(
            "deploy", "bumblebee.commands.deploy:app", "Run a policy on a robot over a wire, or be a simulated robot."
        ),
        Command("model", "bumblebee.commands.model:app", "Make of a URDF a model that loads."),
        Command("import", "bumblebee.cli:import_", "Turn logs of a robot into a dataset."),
        Command("gap", "bumblebee.cli:gap", "Show where a model errs, before anything is fitted."),
        Command("diagnose", "bumblebee.cli:diagnose", "Find which effects the model lacks."),
        Command("replay", "bumblebee.cli:replay", "Compute the error of any model on any rollouts."),
        Command("plan", "bumblebee.commands.plan:plan", "Plan runs that tell apart what a diagnosis could not."),
        Command("compensate", "bumblebee.cli:compensate", "Undo effects at the G1's joints, untrained."),
    ),
    LAB: (
        Command("demo", "flows.cli_loop:demo", "Run the whole loop (`make demo`), or play the shipped policy."),
        Command("serve", "flows.cli_loop:serve", "Open Prefect and MLflow (`make serve`)."),
        Command("report", "flows.cli_loop:report", "Write the loop's report and say where it is."),
        Command("gate", "flows.gates.gate_cli:app", "Answer what the loop asks people."),
        Command("lab", "flows.people.lab_cli:app", "Manage who may use the servers."),
    ),
}
COMMANDS = {command.name: command for commands in TABLE.values() for command in commands}
CHECKOUT = "The loop is run from a clone: git clone, then `make setup` there (README, Install)."
LOOP_PACKAGES = "In the checkout: pip install -e '.[loop,orchestration]'; `bumblebee doctor` lists what is missing."


class Commands(TyperGroup):
    """The commands of the table."""

    def __init__(self, **settings: Any) -> None:
        names = dict.fromkeys(COMMANDS)  # a typo is compared with them
        super().__init__(**settings | {"commands": names})

    def list_commands(self, ctx: Any) -> list[str]:
        """Names, those of one kind together."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Import the command; None for a name that no command has."""
        if cmd_name not in COMMANDS:
            return None
        found = load(COMMANDS[cmd_name])
        app = found if isinstance(found, typer.Typer) else _app_of(found)
        command = typer.main.get_command(app)
        command.name = cmd_name
        return command

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write names and purposes by kind, without importing any command."""
        for kind, commands in TABLE.items():
            with formatter.section(kind):
                formatter.write_dl([(command.name, command.says) for command in commands])


def load(command: Command) -> Any:
    """Import what a command calls.

    Raises:
        BadInput: a package that it needs is not installed.
    """
    module, _, name = command.target.partition(":")
    if not module.startswith("bumblebee."):
        _from_checkout(command.name)
    try:
        return getattr(import_module(module), name)
    except ModuleNotFoundError as error:
        raise missing(error, command.name) from None


def _from_checkout(command: str) -> None:
    """Let the upper floors, folders of a checkout, be imported from the one that the library lies in.

    Raises:
        BadInput: the library was installed by itself.
    """
    home = Path(__file__).parents[2]
    if not (home / "flows" / "cli_loop.py").is_file():
        raise BadInput(f"bumblebee {command}", "BumbleBee's checkout", "the library alone", CHECKOUT)
    if str(home) not in sys.path:
        sys.path.insert(0, str(home))


def missing(error: ModuleNotFoundError, command: str) -> BadInput:
    """The one line for a package that a command needs and that is not installed."""
    return BadInput(f"bumblebee {command}", "its packages", f"no module {error.name!r}", LOOP_PACKAGES)


def _app_of(function: Callable[..., Any]) -> typer.Typer:
    app = typer.Typer(add_completion=False)
    app.command()(function)
    return app
