"""Pictures of a replay without OpenGL or WebGL: triangles painted from back to front; stills, and frames of a film."""

import io
from dataclasses import dataclass

import mujoco
import numpy as np
from PIL import Image, ImageDraw

from bumblebee.report.charts.figures import image_uri
from bumblebee.report.replays.replay import Drawn, Take

_SIZE, _PANELS = 300, 4  # pixels of a panel's side; moments that are shown
_YAW, _PITCH = -0.8, 0.22  # of the camera [rad]; as the player begins
_LIGHT = np.array([0.4, -0.5, 0.9]) / np.linalg.norm([0.4, -0.5, 0.9])
_RIGHT = np.array([-np.sin(_YAW), np.cos(_YAW), 0.0])
_BACK = np.array([np.cos(_PITCH) * np.cos(_YAW), np.cos(_PITCH) * np.sin(_YAW), np.sin(_PITCH)])
_AXES = np.stack([_RIGHT, np.cross(_BACK, _RIGHT), _BACK], axis=1)
_LINES = 0.5 * np.arange(-4, 5)  # on the floor, about the camera's centre [m]
_GREY = (205, 210, 216)


@dataclass(frozen=True)
class Camera:
    """The part of the world that a picture shows."""

    centre: np.ndarray
    """Middle of the picture, (3,) [m]."""
    radius: float
    """Distance from the centre [m] that just fits in."""
    size: tuple[int, int] = (_SIZE, _SIZE)
    """Width and height [pixels]."""

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Right and down [half pixels] and depth [m] of points in the world, (..., 3) both."""
        at = (points - self.centre) @ _AXES
        scale = 0.92 * min(self.size) / max(self.radius, 1e-6)
        return np.stack([self.size[0] + scale * at[..., 0], self.size[1] - scale * at[..., 1], at[..., 2]], axis=-1)


def still_uri(take: Take) -> str:
    """Some moments of a replay side by side, as a `data:` URI."""
    rows = np.linspace(0, len(take.states) - 1, _PANELS).round().astype(int)
    picture = np.concatenate([panel(take, int(row)) for row in rows], axis=1)
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "webp", quality=60, method=5)
    return image_uri(buffer.getvalue(), "webp")


def panel(take: Take, row: int) -> np.ndarray:
    """One moment, (300, 300, 3) uint8 on white."""
    low, high = _box(take, row)
    return _painted(take, row, Camera((low + high) / 2, float(np.linalg.norm(high - low)) / 2), False)


def film_frames(take: Take, rows: np.ndarray, size: tuple[int, int] = (_SIZE, _SIZE)) -> np.ndarray:
    """Frames (F, H, W, 3) uint8 over lines on the floor; the camera goes along with a free base, at one distance.

    Args:
        take: the replay.
        rows: (F,) of its states.
        size: width and height [pixels].
    """
    low, high = np.array([_box(take, int(row)) for row in rows]).swapaxes(0, 1)
    centres = np.tile((low + high).mean(axis=0) / 2, (len(rows), 1))
    if take.shape.free:
        centres[:, :2] = take.states[rows, :2]
    radius = float(np.linalg.norm(high - low, axis=1).max()) / 2
    shown = zip(rows, centres, strict=True)
    return np.stack([_painted(take, int(row), Camera(at, radius, size), take.shape.data["floor"]) for row, at in shown])


def _box(take: Take, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner (3,) [m] of what the first robot takes up."""
    corners = _faces(take, 0, row)[0]
    return corners.min(axis=(0, 1)), corners.max(axis=(0, 1))


def _painted(take: Take, row: int, camera: Camera, floor: bool) -> np.ndarray:
    """One state as (H, W, 3) uint8 on white, each pixel a mean of four."""
    picture = Image.new("RGBA", (2 * camera.size[0], 2 * camera.size[1]), "white")
    if floor:
        _draw_floor(picture, camera)
    order = sorted(range(len(take.robots)), key=lambda robot: take.robots[robot].tint is not None)
    for robot in order:
        picture.alpha_composite(_layer(*_faces(take, robot, row), take.robots[robot], camera))
    return np.asarray(picture.resize(camera.size, Image.Resampling.BOX).convert("RGB"))


def _layer(corners: np.ndarray, rgb: np.ndarray, robot: Drawn, camera: Camera) -> Image.Image:
    """One robot alone on a transparent picture: its triangles, the nearest last, lit from above."""
    seen = camera.seen(corners)  # (F, 3, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    facing = normal @ _BACK
    lit = 0.45 + 0.35 * np.clip(np.sign(facing) * (normal @ _LIGHT), 0, 1) + 0.25 * np.abs(facing)
    base = np.array(robot.tint[:3]) if robot.tint else rgb
    colours = np.clip(255 * lit[:, None] * base, 0, 255).astype(int)
    layer = Image.new("RGBA", (2 * camera.size[0], 2 * camera.size[1]))
    canvas = ImageDraw.Draw(layer)
    for face in np.argsort(seen[..., 2].mean(axis=1)):
        canvas.polygon([(x, y) for x, y in seen[face, :, :2].tolist()], fill=(*colours[face].tolist(), 255))
    if robot.tint:
        share = robot.tint[3]
        layer.putalpha(layer.getchannel("A").point(lambda a: round(a * share)))
    return layer


def _draw_floor(picture: Image.Image, camera: Camera) -> None:
    """Lines at every half metre of the world, so that one sees a robot walk."""
    canvas, middle = ImageDraw.Draw(picture), np.round(2 * camera.centre[:2]) / 2
    for line in _LINES:
        for ends in ([[line, _LINES[0]], [line, _LINES[-1]]], [[_LINES[0], line], [_LINES[-1], line]]):
            at = camera.seen(np.concatenate([middle + np.array(ends), np.zeros((2, 1))], axis=1))
            canvas.line([(x, y) for x, y in at[:, :2].tolist()], fill=_GREY, width=2)


def _faces(take: Take, robot: int, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners (F, 3, 3) of all triangles [m] in the world, and their colours (F, 3)."""
    model = take.shape.model
    data = mujoco.MjData(model)
    data.qpos[:] = take.states[row, robot * model.nq : (robot + 1) * model.nq]
    mujoco.mj_kinematics(model, data)
    corners, colours = [], []
    for part in take.shape.surfaces:
        points = part.points @ data.xmat[part.body].reshape(3, 3).T + data.xpos[part.body]
        corners.append(points[part.faces])
        colours.append(np.tile(part.rgb, (len(part.faces), 1)))
    return np.concatenate(corners), np.concatenate(colours)
