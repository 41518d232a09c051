"""A motion of the robot as a film or a filmstrip (PNG), rendered off-screen or painted without OpenGL."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from bumblebee.errors import BadInput
from bumblebee.io.write import write_file
from bumblebee.motion.clip import Clip, clip_states
from bumblebee.report.films.film_file import require_film, write_film
from bumblebee.report.films.looks import meshes_of_user
from bumblebee.report.films.render import render_frames
from bumblebee.report.replays.replay import Drawn, Take
from bumblebee.report.replays.replay_still import film_frames
from bumblebee.report.replays.shape import shape
from bumblebee.robot.model import build_spec

STRIP = ".png"
"""Suffix of a filmstrip."""
_WIDTH, _HEIGHT = 320, 300  # pixels of a frame
_LONGEST = 120.0  # s of a film


@dataclass(frozen=True)
class PlayConfig:
    """Which part is shown, and how finely."""

    fps: int = 12
    """Frames a second of a film, about: it plays at real speed."""
    panels: int = 8
    """Frames of a filmstrip."""
    start: float = 0.0
    """Where it begins [s]."""
    end: float = 10.0
    """Where it ends at the latest [s]."""


def write_pictures(path: Path, clip: Clip, config: PlayConfig | None = None) -> str:
    """Write a film or a filmstrip (`.png`) of a clip; says how it was drawn.

    Args:
        path: the file; one that is there is replaced.
        clip: the motion.
        config: which part.

    Raises:
        BadInput: a name that `require_film` refuses, or a start after the motion's end.
    """
    config = config or PlayConfig()
    require_film(path, (STRIP,))
    film = path.suffix.lower() != STRIP
    rows, rate = _rows(clip, config, film)
    frames, how = pictures(clip, rows)
    if film:
        write_film(path, frames, rate)
    else:
        write_file(path, _png(np.concatenate(list(frames), axis=1)))
    return f"{len(rows)} frames from {rows[0] / clip.fps:.1f} to {rows[-1] / clip.fps:.1f} s, {how}"


def pictures(clip: Clip, rows: np.ndarray) -> tuple[np.ndarray, str]:
    """Frames (F, H, W, 3) uint8 of some rows of a clip, and how they were drawn."""
    spec, qpos = build_spec(), clip_states(clip)[rows]
    spec.compile()
    frames, how = render_frames(spec.to_xml(), qpos, _WIDTH, _HEIGHT)
    if frames is not None:
        return frames, f"rendered with {how}"
    take = Take(clip.name, "film", qpos, clip.fps, (Drawn("motion"),), shape(spec, meshes_of_user()))
    return film_frames(take, np.arange(len(rows)), (_WIDTH, _HEIGHT)), f"painted, as nothing renders here ({how})"


def _rows(clip: Clip, config: PlayConfig, film: bool) -> tuple[np.ndarray, float]:
    """Which frames are shown, and the film's rate [Hz]."""
    if not 0 <= config.start <= min(config.end, clip.duration):  # also for NaN
        came = f"{config.start:g} to {config.end:g} s"
        raise BadInput("--seconds", f"a part of the motion's 0 to {clip.duration:.1f} s", came)
    if config.end - config.start > _LONGEST:
        raise BadInput("--seconds", f"at most {_LONGEST:g} s", f"{config.end - config.start:g}")
    first, last = round(config.start * clip.fps), min(clip.frames - 1, round(min(config.end, 1e6) * clip.fps))
    if film:
        step = max(round(clip.fps / config.fps), 1)
        return np.arange(first, last + 1, step), clip.fps / step
    return np.unique(np.linspace(first, last, config.panels).round().astype(int)), clip.fps


def _png(pixels: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "png", optimize=True)
    return buffer.getvalue()
