"""mjlab's own G1 tracking task on the same GPU in the same run, in the Python environment that it pins."""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.robot.facts import joint_names

SCRIPT = Path(__file__).with_name("mjlab_loop.py")
GOALS = {"environment": {4096: 3.0, 8192: 2.7}, "loop": 2.5}


@dataclass(frozen=True)
class Peer:
    """Where mjlab is: an interpreter that finds it, and folders of packages to put before that interpreter's own."""

    python: str = sys.executable
    site: str = ""


def write_motion(path: Path, clips: list[Clip]) -> Clip:
    """The longest of `clips` as plain arrays, which `mjlab_loop.py` turns into mjlab's layout; the clip that it is."""
    clip = max(clips, key=lambda one: one.frames)
    np.savez(
        path,
        fps=clip.fps,
        joint_names=np.array(joint_names()),
        root_pos=clip.root_pos,
        root_quat=clip.root_quat,
        joint_pos=clip.joint_pos,
    )
    return clip


def mjlab_rates(
    peer: Peer, clips: list[Clip], worlds: int, seconds: float, device: str = "cuda:0", limit: float = 400.0
) -> dict[str, float]:
    """Control steps a second of mjlab's environment and frames a second of its PPO loop, with its versions.

    Raises:
        BadInput: if it cannot be started, with its last line.
    """
    with tempfile.TemporaryDirectory() as folder:
        motion = Path(folder) / "motion.npz"
        write_motion(motion, clips)
        command = [peer.python, str(SCRIPT), str(motion), str(worlds), str(seconds), device]
        own = os.environ | {
            "PYTHONPATH": peer.site,
            "MJLAB_WARP_QUIET": "1",
            "WANDB_MODE": "disabled",
            "MUJOCO_GL": "disable",
        }
        try:
            done = subprocess.run(command, capture_output=True, text=True, env=own, timeout=limit, cwd=folder)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise BadInput("mjlab", "a Python with mjlab 1.6.0", type(error).__name__) from None
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        last = (done.stderr.strip().splitlines() or ["nothing"])[-1]
        raise BadInput("mjlab", "a Python with mjlab 1.6.0 (--mjlab-python, --mjlab-site)", last)
    return json.loads(lines[-1])


def print_beside(rates: dict[str, float], environment: float, loop: float, worlds: int) -> None:
    """Print the rows of mjlab, and how many times as fast ours are."""
    goals = {"environment": GOALS["environment"].get(worlds, ""), "loop": GOALS["loop"]}
    for name, ours in (("environment", environment), ("loop", loop)):
        ratio = ours / rates[name]
        print(f"{worlds:6d}  mjlab {name:11s} {rates[name]:14.0f}   ours / mjlab {ratio:5.2f}   {goals[name]}")
    print(f"{'':8s}mjlab {rates['mjlab']}, mujoco_warp {rates['mujoco_warp']}, rsl_rl {rates['rsl_rl']}", flush=True)
