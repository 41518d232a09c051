"""The table of commands: each is there, explained and quick to list; a typo and a missing package are one line."""

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from bumblebee.commands import table as commands
from bumblebee.commands.table import COMMANDS, Command
from flows.cli_settings import _class, keys
from tasks.settings.params import SECTIONS
from tests.commands.conftest import run

HOME = Path(__file__).parents[2]
PAGE = (HOME / "docs" / "commands.md").read_text()


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_can_be_imported_and_has_its_place_on_the_page(name):
    assert commands.load(COMMANDS[name])
    assert re.search(rf"^### {name}$", PAGE, re.M)


def test_the_list_of_commands_imports_neither_numbers_nor_networks():
    code = "import sys\nfrom bumblebee import cli\ncli.run(['--help'])\n"
    code += "assert not {'numpy', 'torch', 'mujoco', 'pandas', 'rich', 'prefect'} & set(sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=HOME, capture_output=True, check=False).returncode == 0


@pytest.mark.parametrize("line", ["train nowhere", "evaluate nowhere", "evaluate shipped nowhere", "view nowhere"])
def test_a_path_that_is_not_there_is_refused_before_anything_slow_is_imported(line):
    code = f"import sys\nfrom bumblebee import cli\nsys.argv[1:] = {line.split()!r}\ntry:\n    cli.main()\n"
    code += "finally:\n    print({'numpy', 'torch', 'mujoco', 'pandas'} & set(sys.modules))"
    told = subprocess.run([sys.executable, "-c", code], cwd=HOME, capture_output=True, text=True, check=False)
    assert (told.returncode, told.stdout) == (2, "set()\n"), told.stderr
    assert "nowhere: expected " in told.stderr and told.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("robot inspect nosuch.xml", "an MJCF file, came no such file or folder. `ls "),
        ("train nosuch", "or a motion file, came no such file or folder. `ls "),
        ("settings nosuch", "none of them. `bumblebee settings` prints all."),
        (f"train {HOME} --minutes 0", "--minutes: expected a number above 0, at most 100,000, came 0.0"),
        ("evaluate shipped --limit 1 --repeats=0", "--repeats: expected "),
    ],
)
def test_a_refusal_names_the_users_option_and_what_to_do(line, said, capsys):
    assert run(*line.split()) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1
    if "`ls " in told:
        assert Path(re.search(r"`ls (\S+)`", told)[1]).is_dir()


def test_without_a_command_all_are_listed(capsys):
    assert run() == 0
    said = capsys.readouterr().out
    assert [name for name in COMMANDS if f"\n  {name} " not in said] == []


def test_a_mistyped_command_names_the_near_one(capsys):
    assert run("diagnos") == 2
    assert "Did you mean 'diagnose'?" in capsys.readouterr().err


def test_a_missing_package_is_one_line_that_names_it(capsys, monkeypatch):
    monkeypatch.setitem(COMMANDS, "gap", Command("gap", "nosuchpackage.cli:gap", "x"))
    assert run("gap") == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "no module 'nosuchpackage'" in said


def test_without_a_checkout_the_loop_says_so_in_one_line(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr("bumblebee.__file__", str(tmp_path / "bumblebee" / "__init__.py"))
    assert run("demo") == 2
    assert "a checkout of BumbleBee, with dvc.yaml" in capsys.readouterr().err


@pytest.mark.parametrize("line", ["settings base.ppo", "robot inspect", "--version", "settings gate"])
def test_cheap_examples_of_the_page_run(line, capsys):
    assert f"    bumblebee {line}" in PAGE
    assert run(*line.split()) == 0
    assert capsys.readouterr().out


@pytest.mark.parametrize("section", SECTIONS)
def test_every_key_has_a_meaning(section):
    assert [key for key, _, allowed, meaning in keys(section, _class(section)) if not (allowed and meaning)] == []


def test_a_key_of_a_section_has_that_sections_default(capsys):
    assert run("settings", "experts.env.num_worlds") == 0
    assert "experts.env.num_worlds: 256" in capsys.readouterr().out
    assert run("settings", "bse") == 2
    assert "Did you mean base?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("asked", "near"),
    [("base.pp", "base.ppo"), ("base.ppo.epoch", "base.ppo.epochs"), ("gate.modes", "gate.mode"), ("gat", "gate")],
)
def test_a_key_that_is_not_there_names_the_near_one_be_it_a_part_or_a_key(asked, near, capsys):
    assert run("settings", asked) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and said.endswith(f"Did you mean {near}?\n")
    assert run("settings", near) == 0


def test_the_doctor_says_a_lack_with_a_remedy(capsys, monkeypatch):
    doctor = import_module("bumblebee.commands.doctor")
    monkeypatch.setattr(doctor.shutil, "which", lambda name: None)
    monkeypatch.setattr(doctor, "_DISK", 1e9)
    assert next(line for _, _, line in doctor.browser()).endswith("apt-get install chromium")
    good, needed, line = next(doctor.disk())
    assert not good and needed and "free some" in line


def test_training_on_a_folder_without_motions_is_one_line_and_writes_nothing(capsys, tmp_path):
    (tmp_path / "in").mkdir()
    assert run("train", tmp_path / "in", "--out", tmp_path / "out") == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["in"]
