"""A filmstrip and a short animation of a measured rollout; a stick figure where nothing can be rendered."""

import io
from dataclasses import dataclass

import mujoco
import numpy as np
from PIL import Image

from bumblebee.measured.rollout import Rollout
from bumblebee.report.figures import GRID, canvas, colour, image_uri, svg_uri
from bumblebee.report.render import render_frames
from bumblebee.robot.facts import KEY_BODIES, joint_names

_BONES = (
    ("pelvis", "left_hip_roll_link", "left_knee_link", "left_ankle_roll_link"),
    ("pelvis", "right_hip_roll_link", "right_knee_link", "right_ankle_roll_link"),
    ("pelvis", "torso_link"),
    ("torso_link", "left_shoulder_roll_link", "left_elbow_link", "left_wrist_yaw_link"),
    ("torso_link", "right_shoulder_roll_link", "right_elbow_link", "right_wrist_yaw_link"),
)


@dataclass(frozen=True)
class Film:
    """Pictures as `data:` URIs; `animation` is "" where nothing could be rendered, and `note` says why."""

    strip: str
    animation: str
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
    if frames is None:
        return Film(_stick_strip(qpos, model_xml, panels), "", f"This machine cannot render off-screen ({note}).")
    chosen = np.linspace(0, len(rows) - 1, panels).round().astype(int)
    strip = np.concatenate(list(frames[chosen][:, :, 50:-50]), axis=1)
    return Film(
        image_uri(_webp([strip]), "webp"), image_uri(_webp(list(frames), 1000 // fps), "webp"), f"rendered by {note}"
    )


def _webp(frames: list[np.ndarray], milliseconds: int = 100) -> bytes:
    images = [Image.fromarray(frame) for frame in frames]
    buffer = io.BytesIO()
    images[0].save(buffer, "webp", quality=70, save_all=True, append_images=images[1:], duration=milliseconds, loop=0)
    return buffer.getvalue()


def _stick_strip(qpos: np.ndarray, model_xml: str, panels: int) -> str:
    """The key bodies joined by lines, seen from the side, in a row."""
    model = mujoco.MjModel.from_xml_string(model_xml)
    data = mujoco.MjData(model)
    figure, (axis,) = canvas(1, height=2.4)
    for i, row in enumerate(np.linspace(0, len(qpos) - 1, panels).round().astype(int)):
        data.qpos[:] = qpos[row]
        mujoco.mj_kinematics(model, data)
        at = {name: data.body(name).xpos - [qpos[row, 0], qpos[row, 1], 0] for name in KEY_BODIES}
        for bone in _BONES:
            points = np.array([at[name] for name in bone])
            shade = colour(1) if "left" in bone[-1] else colour(0)
            axis.plot(points[:, 1] * 0.8 + points[:, 0] * 0.6 + i, points[:, 2], "-o", ms=2.5, color=shade, lw=1.8)
    axis.axhline(0, color=GRID)
    axis.set(aspect="equal", xticks=[], ylabel="height [m]")
    return svg_uri(figure)
