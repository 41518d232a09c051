"""Off-screen pictures of the robot, in a process of their own: a missing or broken OpenGL then costs a line, no more.

Run as `python -m bumblebee.report.films.render IN.npz OUT.npz`; `render_frames` does that with each OpenGL backend.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.report.films.looks import meshes_of_user
from bumblebee.report.films.plain_looks import show

BACKENDS = ("egl", "osmesa")
_PELVIS = 0.785  # m, height of the G1's in its stand, which fills the picture


def render_frames(
    model_xml: str, qpos: np.ndarray, width: int = 320, height: int = 300
) -> tuple[np.ndarray | None, str]:
    """Render robot states.

    Args:
        model_xml: MJCF of the model.
        qpos: (F, nq) states.
        width: of a frame [pixels].
        height: of a frame [pixels].

    Returns:
        Frames (F, height, width, 3) uint8, or None; and the backend's name, or why nothing could be rendered.
    """
    asked = os.environ.get("MUJOCO_GL", "")
    reasons = []
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "in.npz", Path(folder) / "out.npz"
        np.savez(source, xml=np.array(model_xml), qpos=qpos, size=np.array([width, height]))
        for backend in [asked] if asked in BACKENDS else BACKENDS:
            command = [sys.executable, "-m", "bumblebee.report.films.render", str(source), str(target)]
            environment = {**os.environ, "MUJOCO_GL": backend, "PYOPENGL_PLATFORM": backend}
            done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)
            if target.exists():
                return np.load(target)["frames"], backend
            reasons.append(f"{backend}: {(done.stderr.strip().splitlines() or ['no reason given'])[-1][:120]}")
    return None, "; ".join(reasons)


def dressed(xml: str) -> mujoco.MjSpec:
    """The model with a chequered floor and the robot's visible shape; physics is not touched, only drawn."""
    spec = mujoco.MjSpec.from_string(xml)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1280, 960
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.45] * 3, [0.35] * 3
    pale = [0.96, 0.97, 0.985]
    sky, flat = mujoco.mjtTexture.mjTEXTURE_SKYBOX, mujoco.mjtBuiltin.mjBUILTIN_FLAT
    spec.add_texture(name="sky", type=sky, builtin=flat, rgb1=pale, rgb2=pale, width=64, height=64)
    spec.add_texture(
        name="squares",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.93, 0.94, 0.96],
        rgb2=[0.86, 0.88, 0.91],
        width=256,
        height=256,
    )
    spec.add_material(name="squares", textures=["", "squares"], texrepeat=[2, 2], texuniform=True)
    spec.geom("floor").material = "squares"
    show(spec, meshes_of_user())
    return spec


def _draw(xml: str, qpos: np.ndarray, width: int, height: int) -> np.ndarray:
    model = dressed(xml).compile()
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    tall = model.key_qpos[0, 2] / _PELVIS if model.nkey else 1.0
    frames = np.empty((len(qpos), height, width, 3), dtype=np.uint8)
    with mujoco.Renderer(model, height, width) as renderer:
        for frame, state in zip(frames, qpos, strict=True):
            data.qpos[:] = state
            mujoco.mj_forward(model, data)
            camera.lookat[:] = (state[0], state[1], 0.68 * tall)
            camera.distance, camera.azimuth, camera.elevation = 2.5 * tall, 130, -12
            renderer.update_scene(data, camera)
            frame[:] = renderer.render()
    return frames


def main() -> None:
    """Read states, write frames; the output appears whole or not at all."""
    source, target = sys.argv[1:3]
    with np.load(source) as given:
        frames = _draw(str(given["xml"]), given["qpos"], *(int(v) for v in given["size"]))
    part = Path(target).with_suffix(".part.npz")
    np.savez(part, frames=frames)
    part.replace(target)
    os._exit(0)  # OpenGL backends fail noisily in the interpreter's last moments


if __name__ == "__main__":
    main()
