"""Several robots beside each other on the same people's motions: the film of docs/results/robots.md.

    python -m benchmarks.robots.film g1_23 g1_29 g1_unitree_23 h1 --motions walk_level3 kick_level1 APT_level1

Folders as of `benchmarks.robots`. Each policy follows the first piece of a motion without noise on the stand-in robot
that lacks nothing; one that falls stands still from there, pale.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from benchmarks.method.places import BASE
from benchmarks.motion_pack import read_pack
from benchmarks.readme_pictures import HOME, run, save
from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import load_policy
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.pieces import motion_of
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.report.films.filmstrip import pale, states
from bumblebee.report.films.render import render_frames
from bumblebee.robot.model import build_spec
from bumblebee.robot.which import VARIABLE

_FPS, _SECONDS = 10.0, 3.6
_WIDTH, _HEIGHT = 200, 260  # pixels, of a robot


def frames_of(folder: Path, motions: list[str]) -> dict[str, np.ndarray]:
    """Motion -> frames (F, H, W, 3) uint8 of this process's robot, whose policy and motions lie in `folder`.

    Raises:
        BadInput: a motion that is not among them.
    """
    with tempfile.TemporaryDirectory() as scratch:
        export_policy(Path(scratch), load_policy(folder / "run" / BASE))
        policy = ExportedPolicy.load(Path(scratch))
    clips = [row.clip for row in read_pack(folder / "motions" / "motions.npz")]
    found = {}
    for motion in motions:
        clip = next((clip for clip in clips if motion_of(clip.name) == motion), None)
        if clip is None:
            raise BadInput(folder, f"a motion named {motion}", "none")
        [rollout] = run(policy, clip, [], {})
        found[motion] = _drawn(rollout, clip)
    return found


def _drawn(rollout: Rollout, clip: Clip) -> np.ndarray:
    rows = np.arange(0, min(clip.frames, _SECONDS * rollout.control_hz), rollout.control_hz / _FPS).astype(int)
    spec = build_spec()
    spec.compile()
    qpos = states(rollout)[np.minimum(rows, rollout.frames - 1)]
    frames, how = render_frames(spec.to_xml(), qpos, _WIDTH, _HEIGHT)
    if frames is None:
        raise RuntimeError(f"nothing can be rendered here: {how}")
    ended = rows >= rollout.frames
    frames[ended] = pale(frames[ended])
    return frames


def beside(every: list[dict[str, np.ndarray]], names: list[str], motions: list[str]) -> list[Image.Image]:
    """The pictures of all robots side by side, one motion after the other."""
    pictures = []
    for motion in motions:
        longest = max(len(frames[motion]) for frames in every)
        for at in range(longest):
            row = [frames[motion][min(at, len(frames[motion]) - 1)] for frames in every]
            picture = Image.fromarray(np.concatenate(row, axis=1))
            pen = ImageDraw.Draw(picture)
            for number, name in enumerate(names):
                pen.text((_WIDTH * number + 10, 8), f"{name}: {motion}", fill=(40, 44, 52), font_size=15)
            pictures.append(picture)
    return pictures


def _in_a_process_of_its_own(folder: Path, motions: list[str]) -> dict[str, np.ndarray]:
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "frames.npz"
        words = [sys.executable, "-m", "benchmarks.robots.film", str(folder), "--out", str(out), "--motions", *motions]
        if status := subprocess.run(words, env=os.environ | {VARIABLE: folder.name}).returncode:
            raise SystemExit(status)  # it has said why
        with np.load(out) as found:
            return dict(found)


def main() -> int:
    """Write the film; to an .npz, the frames of one robot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--motions", nargs="+", required=True)
    parser.add_argument("--out", type=Path, default=HOME / "robots.webp")
    options = parser.parse_args()
    return guarded(lambda: write(options.folders, options.motions, options.out))


def write(folders: list[Path], motions: list[str], out: Path) -> None:
    """Write the film of the robots, or the frames of the first to an .npz."""
    if out.suffix == ".npz":
        np.savez(out, **frames_of(folders[0], motions))
        return
    every = [_in_a_process_of_its_own(folder, motions) for folder in folders]
    save(out, beside(every, [folder.name for folder in folders], motions), _FPS)


if __name__ == "__main__":
    raise SystemExit(main())
