"""A film is written by whatever its name asks for; what a machine cannot write is one line that says what it can."""

import os
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.report.films.film_file import require_film, write_film
from bumblebee.report.replays.replay import GHOST, Drawn, side_by_side
from bumblebee.report.replays.replay_still import film_frames
from tests.report.test_replay import take

FRAMES = np.arange(3, dtype=np.uint8)[:, None, None, None] * np.full((1, 4, 6, 3), 80, np.uint8)


def put_ffmpeg(folder: Path, monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """A stand-in for ffmpeg, first on the path."""
    (folder / "bin").mkdir()
    (folder / "bin" / "ffmpeg").write_text(f"#!/bin/sh\n{script}\n")
    (folder / "bin" / "ffmpeg").chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}")


def test_without_ffmpeg_an_mp4_is_refused_before_anything_is_drawn_and_the_remedy_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BadInput, match="expected the program ffmpeg on the PATH") as refused:
        require_film(tmp_path / "a film.mp4")
    (out,) = shlex.split(re.search(r"--out (.*)$", str(refused.value))[1])
    require_film(Path(out))
    assert write_film(Path(out), FRAMES, 10.0) == Path(out).stat().st_size > 0


def test_ffmpeg_gets_all_frames_with_their_size_and_rate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put_ffmpeg(tmp_path, monkeypatch, f'echo "$@" > {tmp_path}/said; for last; do :; done; cat > "$last"')
    require_film(tmp_path / "film.mp4")
    write_film(tmp_path / "film.mp4", FRAMES, 12.5)
    assert (tmp_path / "film.mp4").read_bytes() == FRAMES.tobytes()
    said = (tmp_path / "said").read_text()
    assert "-s 6x4 -r 12.5" in said and "yuv420p" in said


def test_what_ffmpeg_says_is_told_and_nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put_ffmpeg(tmp_path, monkeypatch, "cat > /dev/null; echo no encoder >&2; exit 1")
    with pytest.raises(BadInput, match=r"came no encoder.* A GIF needs none"):
        write_film(tmp_path / "film.mp4", FRAMES, 12.5)
    assert not (tmp_path / "film.mp4").exists()


def test_the_camera_goes_along_with_a_robot_that_walks_and_the_floor_stays_behind() -> None:
    given = take(frames=3)
    given.states[:] = given.states[0]
    given.states[:, 0] = [0.0, 0.25, 0.5]  # lines lie every half metre
    first, half, whole = film_frames(given, np.arange(3)).astype(int)
    assert (first == whole).all() and (first != half).any()
    assert (first[100:200, 100:200] == half[100:200, 100:200]).mean() > 0.8


def test_a_ghost_is_in_the_film_too() -> None:
    given = take(frames=2)
    both = side_by_side([given.states, given.states + np.eye(given.states.shape[1])[0]])
    robots = (Drawn("a"), Drawn("b", GHOST))
    drawn = film_frames(type(given)("b", "g", both, 50.0, robots, given.shape), np.array([0]))
    assert (drawn != film_frames(given, np.array([0]))).any()
