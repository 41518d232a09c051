"""Outputs of commands: nothing foreign is replaced, the place is tried first, a finished result is kept."""

import json
import os
import signal
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from bumblebee.diagnosis.thresholds import Thresholds
from tests.commands.conftest import run


class Done:
    """A diagnosis that took no time."""

    session, effects = None, ()
    problem = SimpleNamespace(thresholds=Thresholds())
    document = {"schema": 1, "effects": [], "unexplained": {}, "error": {}}  # noqa: RUF012


@pytest.fixture
def at_once(data: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """`diagnose` without its minutes of work: what is read, tried and written is the product's own."""
    from bumblebee.diagnosis import diagnose, output, report
    from bumblebee.report.replays import windows

    monkeypatch.setenv("TMPDIR", str(data / "elsewhere"))
    (data / "elsewhere").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(diagnose, "diagnose", lambda *_: Done)
    monkeypatch.setattr(report, "summary", lambda *_: "found")
    monkeypatch.setattr(report, "examples", lambda *_, **__: [])
    monkeypatch.setattr(windows, "windows_inlay", lambda *_: "")
    files = {name: "x" for name in ("effects.yaml", "model.xml", "report.html")}
    monkeypatch.setattr(output, "contents", lambda made, *_: {"diagnosis.json": json.dumps(made.document), **files})
    return data


def tree(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, hidden ones too."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("out", ["set", ".", "set/rollouts", "set/rollouts/new", "set/new", "link", "link/new"])
@pytest.mark.parametrize("command", ["diagnose", "gap"])
def test_no_output_replaces_or_enters_what_is_read(
    at_once: Path, capsys: pytest.CaptureFixture[str], command: str, out: str
) -> None:
    """`--out ds --overwrite` once deleted ds/rollouts and ended with status 0."""
    (at_once / "link").symlink_to("set")
    before = tree(at_once)
    assert run(command, at_once / "model.xml", at_once / "set", "--out", at_once / out, "--overwrite") == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert tree(at_once) == before


def test_a_mesh_of_the_model_is_an_input(at_once: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Includes and meshes wherever they lie, with the model's own folders for them."""
    (at_once / "parts" / "stl").mkdir(parents=True)
    (at_once / "parts" / "arm.stl").write_text("")
    (at_once / "parts" / "more.xml").write_text('<mujoco><mesh file="arm.stl"/></mujoco>')
    text = '<mujoco><compiler meshdir="parts"/><include file="parts/more.xml"/></mujoco>'
    (at_once / "with.xml").write_text(text)
    for out in ("parts", "parts/arm.stl"):
        assert run("diagnose", at_once / "with.xml", at_once / "set", "--out", at_once / out, "--overwrite") == 2
        assert "does not contain the input" in capsys.readouterr().err


def test_only_an_earlier_diagnosis_is_replaced_and_what_is_foreign_is_named(
    at_once: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not without being told, and never a folder with anything else in it."""
    command = ("diagnose", at_once / "model.xml", at_once / "set", "--out", at_once / "found")
    assert run(*command) == 0
    assert run(*command) == 2 and "--overwrite" in capsys.readouterr().err
    assert run(*command, "--overwrite") == 0
    for name, text in (("notes.txt", "mine"), ("diagnosis.json", "{}")):
        old = (at_once / "found" / name).read_text() if (at_once / "found" / name).exists() else None
        (at_once / "found" / name).write_text(text)
        capsys.readouterr()
        assert run(*command, "--overwrite") == 2
        assert name in capsys.readouterr().err and (at_once / "found" / name).read_text() == text
        (at_once / "found" / name).unlink() if old is None else (at_once / "found" / name).write_text(old)
    assert run(*command, "--overwrite") == 0


def test_replay_replaces_only_its_own_errors(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Not the model, not the effects, no other file, no folder, no device; its own only when told."""
    (data / "effects.yaml").write_text("schema: 1\neffects: []\n")
    (data / "other.json").write_text('{"mine": 1}')
    (data / "pipe").symlink_to(os.devnull)
    command = ("replay", data / "model.xml", data / "set", "--effects", data / "effects.yaml", "--overwrite", "--out")
    before = tree(data)
    for out in ("model.xml", "effects.yaml", "other.json", "set", "set/rollouts/a.parquet", "elsewhere/..", "pipe"):
        assert run(*command, data / out) == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert run(*command, os.devnull) == 2
    assert tree(data) == before
    assert run(*command[:-2], "--out", data / "errors.json") == 0
    assert run(*command[:-2], "--out", data / "errors.json") == 2
    assert run(*command, data / "errors.json") == 0


def no_space(*_: object, **__: object) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("command", ["diagnose", "gap", "replay", "import"])
def test_the_output_is_tried_before_the_work(
    at_once: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    """A full disk, and a folder under a file, end it at once and not after minutes."""
    from bumblebee.diagnosis import dataset
    from bumblebee.measured import importers

    def work(*_: object) -> None:
        raise AssertionError("worked before the output was tried")

    monkeypatch.setattr(dataset, "open_session", work)
    monkeypatch.setattr(importers, "import_dataset", work)
    out = at_once / "model.xml" / "out"
    given = (at_once / "model.xml", at_once / "set", "--out") if command != "import" else (at_once / "set",)
    more = ("--kind", "csv") if command == "import" else ()
    assert run(command, *given, out, *more) == 2
    monkeypatch.setattr(os, "fsync", no_space)
    assert run(command, *given, at_once / "out", *more) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 2 and "No space left" in said
    assert not (at_once / "out").exists()


def test_a_result_whose_place_fails_at_the_end_is_kept_elsewhere(
    at_once: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A disk that is full or gone after minutes of work; the line says where the result is."""
    from bumblebee.io import write

    monkeypatch.setattr(write, "swap", no_space)
    assert run("diagnose", at_once / "model.xml", at_once / "set", "--out", at_once / "found") == 2
    said = capsys.readouterr()
    kept = Path(said.err.split("kept in ")[1].strip().rstrip("."))
    assert "found" in said.out and json.loads((kept / "diagnosis.json").read_text()) == Done.document
    assert not (at_once / "found").exists()
    kept_names = {path.name for path in at_once.iterdir()} - {kept.name}
    assert not any(name.startswith(".") for name in kept_names)


def test_a_name_taken_meanwhile_is_not_replaced_and_the_result_is_kept(
    at_once: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Somebody writes to the folder while the diagnosis runs."""
    from bumblebee.diagnosis import diagnose

    def slow(*_: object) -> type:
        (at_once / "found").mkdir()
        (at_once / "found" / "theirs").write_text("x")
        return Done

    monkeypatch.setattr(diagnose, "diagnose", slow)
    assert run("diagnose", at_once / "model.xml", at_once / "set", "--out", at_once / "found", "--overwrite") == 2
    kept = Path(capsys.readouterr().err.split("kept in ")[1].strip().rstrip("."))
    assert (kept / "report.html").exists()
    assert [path.name for path in (at_once / "found").iterdir()] == ["theirs"]


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_diagnosis_that_is_stopped_leaves_no_half_folder(
    at_once: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], number: int, status: int
) -> None:
    """In the middle of writing; one line and the status that shells give."""
    from bumblebee.io import write

    def stopped(*_: object) -> None:
        os.kill(os.getpid(), number)

    before = tree(at_once)
    monkeypatch.setattr(write, "swap", stopped)
    assert run("diagnose", at_once / "model.xml", at_once / "set", "--out", at_once / "found") == status
    assert capsys.readouterr().err.count("\n") == 1
    assert tree(at_once) == before
