"""Filmstrips of people beside the robot: `python -m benchmarks.retarget.filmstrip PATH NAME... --out strip.png`.

Two rows a motion: the person's landmarks, drawn to the robot's size, and the robot at the same times.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from benchmarks.retarget.compare import FPS
from benchmarks.retarget.landmarks import scaled
from bumblebee.errors import BadInput
from bumblebee.motion.filters.quality import at_times
from bumblebee.motion.formats.convert import noted_clip
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.reading.files import find_motions
from bumblebee.motion.retarget.retarget import retarget
from bumblebee.report.films.playback import pictures

_CHAINS = (
    ("pelvis", "left_hip", "left_knee", "left_ankle", "left_toe"),
    ("pelvis", "right_hip", "right_knee", "right_ankle", "right_toe"),
    ("pelvis", "chest", "neck", "head"),
    ("neck", "left_shoulder", "left_elbow", "left_wrist"),
    ("neck", "right_shoulder", "right_elbow", "right_wrist"),
)
_COLOURS = ((47, 109, 181), (217, 136, 15), (90, 96, 105), (47, 109, 181), (217, 136, 15))
_VIEW = (0.766, 0.643)  # how far x and y go to the right: the camera of the rendered robot
_SCALE, _MARGIN = 170, 34  # pixels a metre; below the floor
_TITLE = 36  # pixels


def strip(motion: HumanMotion, panels: int) -> Image.Image:
    """Two rows of pictures of one motion, the person above the robot."""
    clip, _ = noted_clip(retarget(motion, FPS), FPS)
    rows = np.linspace(0, clip.frames - 1, panels + 2).round().astype(int)[1:-1]
    frames, _ = pictures(clip, rows)
    height, width = frames.shape[1:3]
    person = scaled(at_times(motion.positions, motion.fps, rows / FPS))
    sheet = Image.new("RGB", (panels * width, 2 * height + _TITLE), "white")
    ImageDraw.Draw(sheet).text(
        (6, 4), f"{motion.name}, {clip.duration:.1f} s", fill=(60, 64, 70), font=ImageFont.load_default(26)
    )
    for column, landmarks in enumerate(person):
        sheet.paste(_person(landmarks, width, height), (column * width, _TITLE))
        sheet.paste(Image.fromarray(frames[column]), (column * width, _TITLE + height))
    return sheet


def _person(landmarks: np.ndarray, width: int, height: int) -> Image.Image:
    """One pose (18, 3) [m] as a stick figure over its pelvis."""
    picture = Image.new("RGB", (width, height), "white")
    draw = ImageDraw.Draw(picture)
    at = landmarks - landmarks[0] * np.array([1.0, 1.0, 0.0])
    right, up = width / 2 + _SCALE * (at[:, :2] @ _VIEW), height - _MARGIN - _SCALE * at[:, 2]
    draw.line([(0, height - _MARGIN), (width, height - _MARGIN)], fill=(205, 210, 216), width=2)
    for chain, colour in zip(_CHAINS, _COLOURS, strict=True):
        places = [LANDMARKS.index(name) for name in chain]
        draw.line([(right[i], up[i]) for i in places], fill=colour, width=5, joint="curve")
    return picture


def main() -> None:
    """Write the strips of the motions that are named, one below the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("path", type=Path, help="motions of people, in any format")
    parser.add_argument("names", nargs="+")
    parser.add_argument("--panels", type=int, default=8)
    parser.add_argument("--width", type=int, default=1400, help="of the picture, in pixels")
    parser.add_argument("--out", type=Path, required=True, help="a .png or .webp file")
    options = parser.parse_args()
    found = {m.name: m for file in find_motions(options.path) for m in file.motions if isinstance(m, HumanMotion)}
    for name in options.names:
        if name not in found:
            raise BadInput(options.path, "a motion of that name", name)
    strips = [strip(found[name], options.panels) for name in options.names]
    sheet = Image.new("RGB", (strips[0].width, sum(one.height for one in strips)), "white")
    top = 0
    for one in strips:
        sheet.paste(one, (0, top))
        top += one.height
    size = (options.width, round(sheet.height * options.width / sheet.width))
    sheet.resize(size, Image.Resampling.LANCZOS).save(options.out)


if __name__ == "__main__":
    main()
