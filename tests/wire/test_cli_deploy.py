"""`bumblebee deploy`: what cannot be run is one line and status 2, and each line's remedy works as printed."""

import re
from pathlib import Path

import pytest

from bumblebee.commands import deploy as cli_deploy
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.motion.formats.write import write_motion
from bumblebee.stand_in.sealed import read_sealed
from tests.commands.test_commands import run

ALONE = ("--unattended", "--clip", "squat")


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert run("deploy", *words) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    return said


def test_what_cannot_be_run_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "out"
    for words, expected in (
        (("run", "shipped", "--clip", "squat"), "a terminal, for the dead-man's key"),
        (("run", "shipped", "--unattended", "--clip", "sqat"), "Such as squat"),
        (("run", tmp_path, *ALONE), "contract.json"),
        (("run", "shipped", *ALONE, "--robot", "can"), "sim or lcm"),
        (("run", "shipped", *ALONE, "--limits", tmp_path / "no.yaml"), "no.yaml"),
        (("run", "shipped", *ALONE, "--motions", tmp_path), "motion"),
        (("rollouts", tmp_path / "no.journal", "--out", out), "a journal of"),
        (("robot", "--dropped", "2"), "dropped: expected a number from 0 to 1"),
    ):
        assert expected in refused(capsys, *words, *(("--out", out) if words[0] == "run" else ()))
    assert not out.exists()


def test_csv_files_take_their_rate_as_the_line_asks_for_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    write_motion(tmp_path, make_library(EmbeddedConfig(families=("stand",), limit=1))[0], "g1_csv")
    words = ("sheet", "shipped", "--motions", tmp_path, "--clip", "nosuch")
    said = re.search(r"Say it: (--csv-fps) (\d+) ", refused(capsys, *words))
    assert said and "one of 1 motion, came 'nosuch'" in refused(capsys, *words, *said.groups())


def test_the_worn_robot_of_the_docs_is_sealed_with_what_they_say() -> None:
    home = Path(__file__).parents[2]
    (named,) = re.findall(r"--sealed (\S+\.json)", (home / "docs" / "deploy.md").read_text())
    knee, shoulder = read_sealed(home / named)
    assert knee["parameters"] == {"frictionloss": 4.0} and "knee" in knee["where"][0]
    assert shoulder["parameters"] == {"offset": 0.1} and "shoulder" in shoulder["where"][0]


def test_a_registered_name_without_a_registry_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The line of fetching is passed on; nothing is written."""
    where = ("--workspace", tmp_path / "nowhere", "--out", tmp_path / "out")
    said = refused(capsys, "run", "expert-c0@champion", *ALONE, *where)
    assert "nowhere: expected a workspace" in said and list(tmp_path.iterdir()) == []


def test_without_a_robot_a_simulated_one_can_be_started_as_the_line_says(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bumblebee.wire.safety.preflight._PATIENCE", 0.05)
    monkeypatch.setattr("bumblebee.wire.realtime.harden", lambda priority: [])
    said = refused(capsys, "run", "shipped", *ALONE, "--at", tmp_path / "w", "--out", tmp_path / "out")
    words = said.strip().split("bumblebee ")[-1].split()
    assert words == ["deploy", "robot"] and not (tmp_path / "out").exists()
    assert run(*words, "--seconds", "0.1", "--at", tmp_path / "w") == 0
    assert "a simulated g1_23dof on the wire sim" in capsys.readouterr().out


def test_a_run_that_a_rule_ended_says_so_by_its_status(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from bumblebee.wire.operator.console import Ended
    from bumblebee.wire.operator.screen import Numbers

    for reason, status in (("tilt", cli_deploy.STOPPED), ("", 0)):
        ended = Ended(reason, Numbers(23), {"permitted": ["memory locked"], "refused": {}})
        monkeypatch.setattr("bumblebee.wire.session.run", lambda job, say, watcher, ended=ended: (ended, None))
        assert run("deploy", "run", "shipped", *ALONE, "--out", tmp_path) == status
        assert ("stopped by the rule tilt" in capsys.readouterr().out) == bool(reason)
