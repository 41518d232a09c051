"""The last screen of a loop: the finding in one line, then links and commands that work as printed."""

import json
import re
import shlex
import subprocess
from pathlib import Path

import pytest
import typer

from bumblebee import cli
from flows import ending
from flows.servers import servers
from flows.servers.servers import Addresses
from tasks.approvals.words import program
from tasks.running import paths

FINDING = "3 effects were not in its model; 2 found. Followed: 58\u00a0% before & 89\u00a0% refined."


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Outputs of a finished loop, in this folder."""
    monkeypatch.chdir(tmp_path)
    folder = Path("runs/my lab")
    for path in (folder / paths.REPORT, folder / paths.PUBLISHED):
        path.parent.mkdir(parents=True)
    page = f"<!doctype html><head><title>{FINDING.replace('&', '&amp;')}</title></head><h1>x</h1>"
    (folder / paths.REPORT).write_text(page)
    models = {"base": {"champion": "1"}, "generalist": {"champion": None, "proposal": {"version": "2"}}}
    (folder / paths.PUBLISHED).write_text(json.dumps({"models": models}))
    return folder


def screen(folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    ending.summarise(folder)
    return [line for line in capsys.readouterr().out.splitlines() if line]


def test_the_last_screen_is_the_finding_and_a_line_each_to_go_on(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, *others = screen(workspace, capsys)
    assert first == FINDING.replace("\u00a0", " ")
    assert [line.split()[0] for line in others] == ["report", "policies", "login", "watch", "asked", "next"]
    assert "user bumblebee" in others[2] and "runs/my lab/.servers/login" in others[2]
    report = others[0].split()[1]
    assert report == (Path.cwd() / workspace / paths.REPORT).as_uri() and "%20" in report


def test_every_command_of_the_last_screen_is_known_with_its_options(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = [re.search(rf"{re.escape(program())} (.*)", line) for line in screen(workspace, capsys)]
    commands = [shlex.split(match[1].split("   ")[0]) for match in found if match]
    assert [words[0] for words in commands] == ["serve", "view", "gate", "demo"]
    for words in commands:
        command = typer.main.get_command(cli.app)
        while hasattr(command, "get_command"):
            command = command.get_command(None, words.pop(0))
        command.make_context("bumblebee", words)  # raises for an option that it does not know


def test_the_programs_path_works_without_an_activated_environment(tmp_path: Path) -> None:
    done = subprocess.run([program(), "--version"], cwd=tmp_path, env={"PATH": "/usr/bin:/bin"}, check=False)
    assert done.returncode == 0


def test_a_program_below_this_folder_is_named_from_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ending, "program", lambda: str(tmp_path / ".venv/bin/bumblebee"))
    assert ending.command("view", "models/generalist") == ".venv/bin/bumblebee view models/generalist"
    assert ending.serve(tmp_path) == ".venv/bin/bumblebee serve"


def test_the_policies_page_is_that_of_servers_which_still_run(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Addresses("http://127.0.0.1:4200", "http://127.0.0.1:5001", 1, (2, 3))
    monkeypatch.setattr(servers, "running", lambda folder: kept)
    assert ending.models_page(workspace) == "http://127.0.0.1:5001/#/models"


def test_the_printed_port_of_the_policies_page_is_the_one_that_serve_is_told(workspace: Path) -> None:
    page, _, told = ending.models_page(workspace).partition("   while this runs: ")
    port = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/#/models", page)[1]
    assert shlex.split(told)[-4:] == ["--workspace", "runs/my lab", "--mlflow-port", port]


def test_a_workspace_without_a_report_prints_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert screen(tmp_path, capsys) == []
