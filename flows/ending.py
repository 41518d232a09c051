"""Last screen of a loop: the finding in one line, the report, the policies, how to watch one, and the next step."""

import html
import json
import os
import re
import shlex
from pathlib import Path

from flows.environment import SERVERS
from flows.people import login
from flows.servers import servers
from flows.servers.first_look import MODELS
from tasks.approvals.words import program
from tasks.running import paths


def summarise(folder: Path) -> None:
    """Print the last screen of a workspace whose loop is done; nothing where it has no report."""
    report = folder / paths.REPORT
    if not report.exists():
        return
    print(f"\n{finding(report.read_text(encoding='utf-8'))}\n")
    for what, how in lines(folder):
        print(f"{what:<10}{how}", flush=True)


def finding(page: str) -> str:
    """Title of a report's page in one line: what the loop found, unless `report.title` says otherwise."""
    found = re.search("<title>(.*?)</title>", page, re.DOTALL)
    return " ".join(html.unescape(found[1]).split()) if found else ""


def lines(folder: Path) -> list[tuple[str, str]]:
    """(what, link or command that works as printed here) of a finished workspace."""
    told = [("report", (folder / paths.REPORT).resolve().as_uri()), ("policies", models_page(folder))]
    told += [("login", login_of(folder)), ("watch", command("view", shown(folder / paths.GENERALIST)))]
    models = json.loads((folder / paths.PUBLISHED).read_text())["models"]
    asked = [name for name, facts in models.items() if facts.get("proposal")]
    told += [("asked", command("gate", "show", name, "--workspace", shown(folder))) for name in asked]
    return [*told, ("next", f"{command('demo', '--motions')} FOLDER   runs the loop on your motions")]


def models_page(folder: Path) -> str:
    """MLflow's page of the registered policies, with the command that opens it where no server runs."""
    if (kept := servers.running(folder)) is not None:
        return registry(kept.mlflow)
    with servers.listener() as free:
        port = free.getsockname()[1]
    return f"{registry(f'http://{servers.HOST}:{port}')}   while this runs: {serve(folder, '--mlflow-port', str(port))}"


def login_of(folder: Path) -> str:
    """Which user both servers' pages ask for, and where the password is."""
    place = shown(folder / SERVERS / login.NAME)
    return f"user {login.USER}, password behind the colon in {place}; Prefect's page takes that whole line"


def registry(mlflow: str) -> str:
    """Address of MLflow's page of all registered policies, below the server's address."""
    return f"{mlflow}/{MODELS}"


def serve(folder: Path, *options: str) -> str:
    """Command that opens this workspace's servers again."""
    where = () if folder.resolve() == Path.cwd() else ("--workspace", shown(folder))
    return command("serve", *where, *options)


def command(*words: str) -> str:
    """A `bumblebee` command that works as printed in this folder, whether or not its environment is activated."""
    return shlex.join([shown(Path(program())), *words])


def shown(path: Path) -> str:
    """The path as a person would name it from here."""
    short = os.path.relpath(path)
    return str(path) if short.startswith("..") else short
