"""One file of a source that needs no server: a page with a 3D replay, or a film."""

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.io.write import write_file
from bumblebee.report.films.film_file import write_film
from bumblebee.report.replays.replay import Take, part
from bumblebee.report.replays.replay_page import replay_page
from bumblebee.report.replays.replay_still import film_frames
from bumblebee.report.replays.shape import shape
from bumblebee.robot.model import build_spec
from bumblebee.view.sources import Source

PAGE = ".html"
"""Suffix of a page; any other is a film's."""
_FPS = 12  # frames a second of a film, about


def record(
    source: Source,
    name: str = "",
    meshes: Path | None = None,
    seconds: float = 10.0,
    make: Callable[[], mujoco.MjSpec] | None = None,
) -> Take:
    """Record a source from its first frame.

    Args:
        source: what is recorded.
        name: heading of the page.
        meshes: folder of the G1's meshes; None for primitives.
        seconds: length of the recording at most [s].
        make: spec of another robot than the G1.
    """
    source.seek(0)
    states = [source.qpos().copy()]
    for _ in range(min(source.frames - 1, round(seconds * source.fps))):
        source.advance()
        states.append(source.qpos().copy())
    drawn = shape(make() if make else build_spec(), meshes)
    return Take(name, "replay", np.stack(states), source.fps, tuple(source.robots), drawn, source.said())


def write_take(path: Path, take: Take) -> int:
    """Write a recording as a page that asks for nothing from elsewhere, or as a film; returns the number of bytes.

    Args:
        path: `.html`, or a name that `require_film` lets pass; one that is there is replaced.
        take: the recording; a page keeps at most `LARGEST` bytes of it.
    """
    if path.suffix.lower() == PAGE:
        text = replay_page(take, part([take])).encode()
        write_file(path, text)
        return len(text)
    step = max(round(take.fps / _FPS), 1)
    return write_film(path, film_frames(take, np.arange(0, len(take.states), step)), take.fps / step)
