"""`bumblebee motions`: tables that add up, films that exist, status 2 and one line for what cannot be done."""

import csv
import re
import sys
from functools import partial

import numpy as np
import pytest
from PIL import Image

import bumblebee as bb
from bumblebee import cli
from bumblebee.motion.formats.write import write_motion
from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import joint_names, stand_pose
from tests.commands.conftest import run as run_command
from tests.motion.conftest import standing

run = partial(run_command, "motions")


@pytest.fixture
def folder(tmp_path):
    """Two good motions at 50 Hz and a bad one."""
    time = np.arange(60) / 50
    joints = stand_pose() + 0.1 * np.sin(3 * time)[:, None] * np.linspace(0.2, 1, len(joint_names()))
    upright = np.tile([1.0, 0, 0, 0], (60, 1))
    root = standing(upright, joints)
    for name, kind in (("walk", "asap"), ("sway", "g1_csv")):
        write_motion(tmp_path / "in", make_clip(name, 50.0, root, upright, joints), kind)
    (tmp_path / "in/bad.pkl").write_bytes(b"\x80")
    return tmp_path / "in"


def test_inspect_says_what_is_there_and_what_is_wrong(folder, capsys):
    assert run("inspect", folder, "--csv-fps", 50) == 0
    said = capsys.readouterr().out
    assert "3 files: 2 read, 1 not. 2 motions: 2 usable (2 s), 0 with a problem." in said
    assert "bad.pkl: expected a whole pickle" in said and "50 (setting)" in said and "50 (file)" in said
    assert run("inspect", folder) == 0  # the pickle is still read
    assert "sway.csv: expected a frame rate, which a CSV file does not hold" in capsys.readouterr().out
    assert run("inspect", folder, "--rows", 1, "--csv-fps", 50) == 0
    assert "... and 1 more motion (--rows)" in capsys.readouterr().out


def test_inspect_calls_two_motions_of_one_name_as_play_does(folder, capsys):
    (folder / "again").mkdir()
    (folder / "again/walk.pkl").write_bytes((folder / "walk.pkl").read_bytes())
    assert run("inspect", folder, "--csv-fps", 50) == 0
    shown = re.findall(r"^(\S+) +\S+\.(?:pkl|csv) ", capsys.readouterr().out, re.M)
    assert run("play", folder, "--out", folder.parent / "a.gif", "--csv-fps", 50) == 2
    assert f"--motion: {', '.join(shown)}\n" in capsys.readouterr().err and len(set(shown)) == 3


def test_inspect_of_nothing_readable_is_status_two_and_one_line(folder, capsys):
    assert run("inspect", folder / "bad.pkl") == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert run("inspect", folder / "none") == 2
    assert "no such file or folder" in capsys.readouterr().err


def test_names_cannot_write_to_the_terminal(folder, capsys):
    (folder / "bad.pkl").rename(folder / "a\x1b[31m[red]b.pkl")
    (folder / "walk.pkl").rename(folder / "w\x1b[31m[bold]k.pkl")
    assert run("inspect", folder, "--csv-fps", 50) == 0
    said = capsys.readouterr().out
    assert "\x1b" not in said and "[bold]" in said


def test_read_motions_evaluate_and_view_say_in_the_same_line_what_is_skipped_and_why(folder, tmp_path, capsys):
    with pytest.warns(UserWarning, match="skipped: expected a whole pickle.*: bad.pkl") as heard:
        bb.read_motions(folder, csv_fps=50)
    line = str(heard[0].message)
    assert heard[0].filename == __file__
    assert cli.run(["evaluate", "shipped", str(folder), "--csv-fps", "50", "--limit", "1"]) == 0
    assert line in capsys.readouterr().out.splitlines()
    page = tmp_path / "replay.html"
    assert cli.run(["view", str(folder), "--csv-fps", "50", "--out", str(page), "--seconds", "0.2"]) == 0
    assert line in capsys.readouterr().out.splitlines()


def test_convert_writes_and_says_the_rates(folder, tmp_path, capsys):
    assert run("convert", folder, "--out", tmp_path / "out", "--to", "mjlab", "--csv-fps", 50) == 0
    said = capsys.readouterr()
    assert "3 files: 2 motions written, 1 skipped" in said.out and "skipped: bad.pkl: expected" in said.err
    with (tmp_path / "out/LICENCES.csv").open() as file:
        assert [row["file"] for row in csv.DictReader(file)] == ["sway.npz", "walk.npz"]
    assert run("convert", folder, "--out", tmp_path / "out", "--to", "mjlab", "--csv-fps", 50) == 2
    assert "Add --overwrite" in capsys.readouterr().err
    assert run("convert", tmp_path / "out", "--out", tmp_path / "csv", "--to", "g1_csv", "--fps", 30) == 0
    assert "LICENCES.csv says 30 Hz, other programs must be told" in capsys.readouterr().out
    assert run("convert", tmp_path / "csv", "--out", tmp_path / "back", "--to", "mjlab", "--fps", 60) == 0
    assert "Mind: mjlab plays a frame each step" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("--to", "bvh"), "--to: expected one of g1_csv, asap, mjlab, library"),
        (("--to", "asap", "--set", "csv_length=inch"), "--set csv_length: expected one of m, cm, mm"),
        (
            ("--to", "asap", "--set", "rate=3"),
            "--set: expected KEY=VALUE with a key among csv_fps, csv_length, csv_angle",
        ),
        (("--to", "asap", "--fps", "0"), "Invalid value for '--fps'"),
    ],
)
def test_options_out_of_range_are_one_line(folder, tmp_path, capsys, arguments, line):
    assert run("convert", folder, "--out", tmp_path / "out", *arguments) == 2
    said = capsys.readouterr().err
    assert line in said and said.count("\n") == 1 and not (tmp_path / "out").exists()


@pytest.mark.parametrize("renders", [True, False])
def test_play_makes_a_film_and_a_filmstrip_with_and_without_opengl(folder, tmp_path, capsys, monkeypatch, renders):
    from bumblebee.report.films import playback

    def drawn(xml, qpos, width, height):  # every frame of another grey
        shades = np.arange(len(qpos), dtype=np.uint8)[:, None, None, None]
        return np.broadcast_to(90 + shades, (len(qpos), height, width, 3)), "test"

    monkeypatch.setattr(playback, "render_frames", drawn if renders else lambda *_: (None, "egl: no device"))
    assert run("play", folder / "walk.pkl", "--out", tmp_path / "film.gif") == 0
    assert "] drawing walk\n" in capsys.readouterr().out
    with Image.open(tmp_path / "film.gif") as film:
        assert film.size == (320, 300) and 5 < film.n_frames <= 15  # the encoder joins frames that are alike
        shown = [(film.seek(number), film.info["duration"])[1] for number in range(film.n_frames)]
    assert sum(shown) == 15 * 80  # ms: every fourth frame of 50 Hz
    assert run("play", folder, "--motion", "walk", "--out", tmp_path / "strip.png", "--panels", 4) == 0
    with Image.open(tmp_path / "strip.png") as strip:
        assert strip.size == (4 * 320, 300)
        colours = {colour for _, colour in strip.convert("RGB").getcolors(1 << 20)}
    assert len(colours) == 4 if renders else len(colours) > 20  # greys, or the robot in its colours
    assert ("painted, as nothing renders here (egl: no device)" in capsys.readouterr().out) is not renders


def test_play_asks_for_what_it_needs(folder, tmp_path, capsys, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    (tmp_path / "mine.gif").write_text("precious")
    cases = [
        ((folder / "walk.pkl",), "--out: expected film.gif or film.png on a machine without a display"),
        ((folder, "--out", tmp_path / "a.gif", "--csv-fps", 50), "came several motions. --motion: sway, walk"),
        ((folder, "--out", tmp_path / "a.gif", "--motion", "run"), "expected the name of one motion, came 'run'"),
        (
            (folder / "bad.pkl", "--out", tmp_path / "a.gif"),
            "in/bad.pkl: expected a whole pickle, came a broken one",
        ),
        ((folder / "walk.pkl", "--out", tmp_path / "a.avi"), "a name that ends in .gif, .webp, .mp4 or .png"),
        (
            (folder / "walk.pkl", "--out", tmp_path / "a.gif", "--seconds", 9, 10),
            "of the motion's 0 to 1.2 s, came 9 to 10",
        ),
        ((folder / "walk.pkl", "--out", tmp_path / "a.gif", "--seconds", "nan", 10), "of the motion's 0 to 1.2 s"),
        ((folder / "walk.pkl", "--out", tmp_path / "a.gif", "--seconds", 0, 900), "expected at most 120 s, came 900"),
        ((folder / "walk.pkl", "--out", tmp_path / "mine.gif"), "expected a new name"),
        ((folder / "walk.pkl", "--out", folder / "walk.pkl"), "an output that does not contain the input"),
    ]
    for arguments, line in cases:
        assert run("play", *arguments) == 2, arguments
        said = capsys.readouterr().err
        assert line in said and said.count("\n") == 1
    assert (tmp_path / "mine.gif").read_text() == "precious" and not (tmp_path / "a.gif").exists()
