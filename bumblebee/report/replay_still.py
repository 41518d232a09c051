"""A picture of a replay for pages without scripts or WebGL: triangles painted from back to front, without OpenGL."""

import io

import mujoco
import numpy as np
from PIL import Image, ImageDraw

from bumblebee.report.figures import image_uri
from bumblebee.report.replay import Take

_SIZE, _PANELS = 300, 4  # pixels of a panel's side; moments that are shown
_YAW, _PITCH = -0.8, 0.22  # of the camera [rad]; as the player begins
_LIGHT = np.array([0.4, -0.5, 0.9]) / np.linalg.norm([0.4, -0.5, 0.9])


def still_uri(take: Take) -> str:
    """Some moments of a replay side by side, as a `data:` URI."""
    rows = np.linspace(0, len(take.states) - 1, _PANELS).round().astype(int)
    picture = np.concatenate([panel(take, int(row)) for row in rows], axis=1)
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "webp", quality=60, method=5)
    return image_uri(buffer.getvalue(), "webp")


def panel(take: Take, row: int) -> np.ndarray:
    """One moment, (300, 300, 3) uint8 on white."""
    right = np.array([-np.sin(_YAW), np.cos(_YAW), 0.0])
    back = np.array([np.cos(_PITCH) * np.cos(_YAW), np.cos(_PITCH) * np.sin(_YAW), np.sin(_PITCH)])
    axes = np.stack([right, np.cross(back, right), back], axis=1)
    drawn = [_faces(take, robot, row) for robot in range(len(take.robots))]
    first = drawn[0][0].reshape(-1, 3)
    centre = (first.min(axis=0) + first.max(axis=0)) / 2
    scale = 0.92 * _SIZE / max(float(np.linalg.norm(first.max(axis=0) - first.min(axis=0))) / 2, 1e-6)
    picture = Image.new("RGBA", (2 * _SIZE, 2 * _SIZE), "white")
    for (corners, rgb), robot in sorted(zip(drawn, take.robots, strict=True), key=lambda one: one[1].tint is not None):
        seen = (corners - centre) @ axes  # (F, 3, 3)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        facing = normal @ back
        lit = 0.45 + 0.35 * np.clip(np.sign(facing) * (normal @ _LIGHT), 0, 1) + 0.25 * np.abs(facing)
        base = np.array(robot.tint[:3]) if robot.tint else rgb
        colours = np.clip(255 * lit[:, None] * base, 0, 255).astype(int)
        at = np.stack([_SIZE + scale * seen[..., 0], _SIZE - scale * seen[..., 1]], axis=-1)
        layer = Image.new("RGBA", picture.size)
        canvas = ImageDraw.Draw(layer)
        for face in np.argsort(seen[..., 2].mean(axis=1)):
            canvas.polygon([(x, y) for x, y in at[face].tolist()], fill=(*colours[face].tolist(), 255))
        if robot.tint:
            layer.putalpha(layer.getchannel("A").point(lambda a, share=robot.tint[3]: round(a * share)))
        picture.alpha_composite(layer)
    return np.asarray(picture.resize((_SIZE, _SIZE), Image.Resampling.BOX).convert("RGB"))


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
