"""Stills and a film of a measured rollout; a stick figure where nothing can be rendered.

The film is one picture that holds all frames in rows, which the page's player shows one at a time: no video format,
no decoder to ask for, and a still without scripts.
"""

import io
from dataclasses import dataclass

import mujoco
import numpy as np
from PIL import Image

from bumblebee.measured.rollout import Rollout
from bumblebee.report.charts.figures import GRID, canvas, colour, image_uri, svg_uri
from bumblebee.report.films.render import render_frames
from bumblebee.robot.facts import BODY_OF, KEY_BODIES, PELVIS, TORSO, joint_names
from bumblebee.robot.written import SIDES

_BONES = (
    *((PELVIS, *(BODY_OF[f"{side}_{part}"] for part in ("hip", "knee", "foot"))) for side in SIDES),
    (PELVIS, TORSO),
    *((TORSO, *(BODY_OF[f"{side}_{part}"] for part in ("shoulder", "elbow", "hand"))) for side in SIDES),
)


_LEFT = {body for role, body in BODY_OF.items() if role.startswith("left_")}
_COLUMNS = 9
_GAP = 8  # pixels between two films side by side


@dataclass(frozen=True)
class Sheet:
    """All frames of a film in one picture, row by row."""

    uri: str
    frames: int
    columns: int
    rows: int
    fps: float
    width: int
    """Width of a frame [pixels]."""
    height: int
    """Height of a frame [pixels]."""


@dataclass(frozen=True)
class Film:
    """Pictures as `data:` URIs; `sheet` is None where nothing could be rendered, and `note` says why."""

    stills: tuple[tuple[float, str], ...]
    """(seconds from the start, picture)."""
    sheet: Sheet | None
    note: str


def states(rollout: Rollout) -> np.ndarray:
    """(T, 30) qpos of the G1 from a rollout that has `base_pos` and `base_quat`."""
    order = [rollout.joints.index(name) for name in joint_names()]
    return np.concatenate([rollout.base_pos, rollout.base_quat, rollout.joint_pos[:, order]], axis=1)


def film(rollout: Rollout, model_xml: str, panels: int = 8, fps: int = 12, seconds: float = 6.0) -> Film:
    """Pictures of one rollout."""
    qpos = states(rollout)
    step = max(round(rollout.control_hz / fps), 1)
    rows = np.arange(0, min(len(qpos), round(seconds * rollout.control_hz)), step)
    frames, note = render_frames(model_xml, qpos[rows])
    chosen = np.linspace(0, len(rows) - 1, panels).round().astype(int)
    times = [float(rows[i] / rollout.control_hz) for i in chosen]
    if frames is None:
        stills = _stick_stills(qpos[rows[chosen]], model_xml)
        return Film(tuple(zip(times, stills, strict=True)), None, f"This machine cannot render off-screen ({note}).")
    stills = [image_uri(_webp(frames[i]), "webp") for i in chosen]
    shown = sheet(frames, rollout.control_hz / step)
    return Film(tuple(zip(times, stills, strict=True)), shown, f"Rendered with {note}.")


def film_pair(
    before: Rollout, after: Rollout, model_xml: str, start: float = 0.0, fps: int = 12, seconds: float = 6.0
) -> Film:
    """Two rollouts of one motion side by side, on one clock; one that has ended stands still and pale.

    Args:
        before: on the left.
        after: on the right, recorded at the same rate.
        model_xml: MJCF of the robot.
        start: where the film begins [s].
        fps: frames a second, about.
        seconds: length of the film.
    """
    step = max(round(before.control_hz / fps), 1)
    longest = max(before.frames, after.frames)
    first = min(round(start * before.control_hz), longest - 1)
    rows = np.arange(first, min(longest, first + round(seconds * before.control_hz)), step)
    qpos = [states(rollout)[np.minimum(rows, rollout.frames - 1)] for rollout in (before, after)]
    frames, why = render_frames(model_xml, np.concatenate(qpos), width=288, height=300)
    if frames is None:
        chosen = np.linspace(0, len(rows) - 1, 3).round().astype(int)
        times = [float(rows[i] / before.control_hz) for i in chosen]
        stills = [zip(times, _stick_stills(side[chosen], model_xml), strict=True) for side in qpos]
        return Film((*stills[0], *stills[1]), None, f"This machine cannot render off-screen ({why}).")
    halves = np.split(frames, 2)
    for half, rollout in zip(halves, (before, after), strict=True):
        half[rows >= rollout.frames] = pale(half[rows >= rollout.frames])
    gap = np.full((len(rows), halves[0].shape[1], _GAP, 3), 255, np.uint8)
    both = np.concatenate([halves[0], gap, halves[1]], axis=2)
    return Film((), sheet(both, before.control_hz / step), f"Rendered with {why}.")


def pale(frames: np.ndarray) -> np.ndarray:
    """Frames (..., 3) uint8 of a robot that has fallen."""
    return (0.45 * frames + 0.55 * 255).astype(np.uint8)


def sheet(frames: np.ndarray, fps: float) -> Sheet:
    """Lay frames (F, H, W, 3) uint8 out in rows."""
    count, height, width, _ = frames.shape
    columns = min(_COLUMNS, count)
    rows = -(-count // columns)
    padded = np.concatenate([frames, np.repeat(frames[-1:], rows * columns - count, axis=0)])
    grid = padded.reshape(rows, columns, height, width, 3).swapaxes(1, 2).reshape(rows * height, columns * width, 3)
    return Sheet(image_uri(_webp(grid), "webp"), count, columns, rows, fps, width, height)


def _webp(pixels: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "webp", quality=70, method=5)
    return buffer.getvalue()


def _stick_stills(qpos: np.ndarray, model_xml: str) -> list[str]:
    """The key bodies joined by lines, seen from the side; lines on the ground and at every half metre."""
    model = mujoco.MjModel.from_xml_string(model_xml)
    data = mujoco.MjData(model)
    pictures = []
    for state in qpos:
        data.qpos[:] = state
        mujoco.mj_kinematics(model, data)
        at = {name: data.body(name).xpos - [state[0], state[1], 0] for name in KEY_BODIES}
        figure, axis = canvas(height=1.9, width=1.7)
        for bone in _BONES:
            points = np.array([at[name] for name in bone])
            shade = colour(1) if bone[-1] in _LEFT else colour(0)
            axis.plot(points[:, 1] * 0.8 + points[:, 0] * 0.6, points[:, 2], "-o", ms=2.5, color=shade, lw=1.8)
        for height in (0.0, 0.5, 1.0):
            axis.axhline(height, color=GRID, zorder=0)
        axis.set(aspect="equal", xlim=(-0.6, 0.6), ylim=(-0.05, 1.4))
        axis.set_axis_off()
        pictures.append(svg_uri(figure))
    return pictures
