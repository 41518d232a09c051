"""A motion of the robot as a film (GIF) or a filmstrip (PNG), rendered off-screen or drawn as a stick figure."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from bumblebee.errors import BadInput
from bumblebee.io.write import write_file
from bumblebee.motion.clip import Clip
from bumblebee.report.render import render_frames
from bumblebee.robot.facts import KEY_BODIES
from bumblebee.robot.model import build_spec

SUFFIXES = (".gif", ".png")
_WIDTH, _HEIGHT = 320, 300  # pixels of a frame
_SCALE, _GROUND = 170, 262  # pixels a metre; the row of the floor
_LONGEST = 120.0  # s of a film
_VIEW = (0.6, -0.8)  # how far x and y go to the right
_BONES = (
    ("pelvis", "left_hip_roll_link", "left_knee_link", "left_ankle_roll_link"),
    ("pelvis", "right_hip_roll_link", "right_knee_link", "right_ankle_roll_link"),
    ("pelvis", "torso_link"),
    ("torso_link", "left_shoulder_roll_link", "left_elbow_link", "left_wrist_yaw_link"),
    ("torso_link", "right_shoulder_roll_link", "right_elbow_link", "right_wrist_yaw_link"),
)
_LEFT, _RIGHT, _GREY = (47, 109, 181), (217, 136, 15), (205, 210, 216)


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
    """Write a film (`.gif`) or a filmstrip (`.png`) of a clip; says how it was drawn.

    Args:
        path: the file; one that is there is replaced.
        clip: the motion.
        config: which part.

    Raises:
        BadInput: another suffix, or a start after the motion's end.
    """
    config = config or PlayConfig()
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise BadInput(path, f"a name that ends in {' or '.join(SUFFIXES)}", f"{suffix[:20]!r}")
    rows, rate = _rows(clip, config, suffix == ".gif")
    frames, how = pictures(clip, rows)
    write_file(path, _gif(frames, rate) if suffix == ".gif" else _png(np.concatenate(list(frames), axis=1)))
    return f"{len(rows)} frames from {rows[0] / clip.fps:.1f} to {rows[-1] / clip.fps:.1f} s, {how}"


def pictures(clip: Clip, rows: np.ndarray) -> tuple[np.ndarray, str]:
    """Frames (F, H, W, 3) uint8 of some rows of a clip, and how they were drawn."""
    spec = build_spec()
    spec.compile()
    qpos = np.concatenate([clip.root_pos, clip.root_quat, clip.joint_pos], axis=1)[rows].astype(np.float64)
    frames, how = render_frames(spec.to_xml(), qpos, _WIDTH, _HEIGHT)
    if frames is not None:
        return frames, f"rendered with {how}"
    return np.stack([_stick(clip.key_pos[row]) for row in rows]), f"drawn, as nothing can be rendered here ({how})"


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


def _stick(bodies: np.ndarray) -> np.ndarray:
    """The key bodies (14, 3) [m] joined by lines, on white, the pelvis in the middle."""
    picture = Image.new("RGB", (_WIDTH, _HEIGHT), "white")
    draw = ImageDraw.Draw(picture)
    for height in (0.0, 0.5, 1.0):
        draw.line([(0, _GROUND - height * _SCALE), (_WIDTH, _GROUND - height * _SCALE)], fill=_GREY)
    centre = bodies[KEY_BODIES.index("pelvis"), :2]
    for bone in _BONES:
        points = bodies[[KEY_BODIES.index(name) for name in bone]]
        across = (points[:, :2] - centre) @ np.array(_VIEW)
        at = np.stack([_WIDTH / 2 + across * _SCALE, _GROUND - points[:, 2] * _SCALE], axis=1)
        draw.line([(float(x), float(y)) for x, y in at], fill=_LEFT if "left" in bone[-1] else _RIGHT, width=5)
    return np.asarray(picture)


def _gif(frames: np.ndarray, rate: float) -> bytes:
    images = [Image.fromarray(frame).quantize(128) for frame in frames]
    # A GIF counts hundredths of a second: frames differ by one, so that the film as a whole keeps real speed.
    ends = np.round(np.arange(1, len(images) + 1) * 100 / rate).astype(int)
    lengths = [int(length) * 10 for length in np.diff(ends, prepend=0)]
    buffer = io.BytesIO()
    images[0].save(buffer, "gif", save_all=True, append_images=images[1:], duration=lengths, loop=0)
    return buffer.getvalue()


def _png(pixels: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "png", optimize=True)
    return buffer.getvalue()
