"""Retargeters on the same people: `python -m benchmarks.retarget.compare PATH --out table.json`.

A retargeter is any function from a `HumanMotion` to a `RawMotion`, named on the command line as `package.module:name`.
`--reference` names somebody's result on the robot under the same names, which is measured beside them. Where PATH holds
motions of the robot, their landmarks are the people: there is a motion that follows them exactly, and the joint error
against it tells what a retargeter loses.
"""

import argparse
import importlib
import json
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np

from benchmarks.retarget.landmarks import person_of, robot_landmarks, scaled
from benchmarks.retarget.table import markdown, summary
from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.quality import at_times, joint_error, keypoint_error, quality
from bumblebee.motion.formats.convert import noted_clip
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.files import find_motions
from bumblebee.motion.resample import resample
from bumblebee.progress import progress

Retargeter = Callable[[HumanMotion], RawMotion]
FPS = 50.0  # of the clips that are judged
OURS = "bumblebee.motion.retarget.retarget:retarget"


def judged(
    retargeter: Retargeter, motion: HumanMotion, reference: Clip | None = None, fps: float = FPS
) -> dict[str, float]:
    """One motion retargeted and measured: speed, distance from the scaled person, from a reference, and quality."""
    began = time.process_time()
    raw = retargeter(motion)
    seconds = time.process_time() - began
    row = {"frames_a_second": len(motion.positions) / max(seconds, 1e-9)}
    return row | against(motion, raw, reference, fps)


def against(motion: HumanMotion, raw: RawMotion, reference: Clip | None = None, fps: float = FPS) -> dict[str, float]:
    """Measures of a retargeted motion, however it was made (another's result, too).

    `landmark_mm` is the mean distance of the robot's landmarks from those of the person scaled to its size, both
    relative to the pelvis; `joint_rad`, `keypoint_mm`, `keypoint_local_mm` are those against the reference.
    """
    even = resample(raw, fps)
    clip = make_clip(motion.name, fps, even.root_pos, even.root_quat, even.joint_pos)
    person = at_times(motion.positions, motion.fps, np.arange(clip.frames) / fps)
    there, wanted = robot_landmarks(clip.root_pos, clip.root_quat, clip.joint_pos), scaled(person)
    apart = np.linalg.norm((there - there[:, :1]) - (wanted - wanted[:, :1]), axis=-1)[:, 1:]
    row = {"landmark_mm": 1000 * float(apart.mean())}
    if reference is not None:
        error = keypoint_error(clip, reference)
        row |= {"joint_rad": joint_error(clip, reference), "keypoint_mm": error["global_mm"]}
        row |= {"keypoint_local_mm": error["root_relative_mm"]}
    return row | quality(clip, person)


def compare(
    retargeters: Mapping[str, Retargeter], motions: Iterable[tuple[HumanMotion, Clip | None]]
) -> dict[str, dict[str, dict[str, float]]]:
    """Each retargeter on each motion: name -> motion -> measures."""
    motions = list(motions)
    found: dict[str, dict[str, dict[str, float]]] = {name: {} for name in retargeters}
    for name, retargeter in retargeters.items():
        with progress(len(motions), name, "motions") as bar:
            for motion, reference in motions:
                found[name][motion.name] = judged(retargeter, motion, reference)
                bar.update(1)
    return found


def named(text: str) -> Retargeter:
    """The function that `package.module:name` names."""
    module, _, name = text.partition(":")
    return getattr(importlib.import_module(module), name)


def people(path: Path, references: Mapping[str, Clip]) -> list[tuple[HumanMotion, Clip | None]]:
    """The motions of people at `path`; of the robot's, their landmarks stand for a person who can be followed."""
    found: list[tuple[HumanMotion, Clip | None]] = []
    for file in find_motions(path):
        for motion in file.motions:
            if isinstance(motion, HumanMotion):
                found.append((motion, references.get(motion.name)))
            elif isinstance(motion, RawMotion):
                clip, _ = noted_clip(motion, FPS)
                found.append((person_of(clip), clip))
    return found


def main() -> None:
    """Compare the retargeters named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("path", type=Path, help="motions of people, in any format; of the robot: their landmarks")
    parser.add_argument("--retargeters", nargs="+", default=[OURS], help="package.module:name")
    parser.add_argument("--reference", type=Path, help="somebody's result on the robot, under the same names")
    parser.add_argument("--every", type=int, default=1, help="take every n-th motion")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    raws = (
        {raw.name: raw for file in find_motions(options.reference) for raw in file.motions} if options.reference else {}
    )
    motions = people(options.path, {name: noted_clip(raw, FPS)[0] for name, raw in raws.items()})[:: options.every]
    found = compare({text: named(text) for text in options.retargeters}, motions)
    if raws:
        theirs = {m.name: against(m, raws[m.name], reference) for m, reference in motions if m.name in raws}
        found["reference"] = theirs
    tables = {name: {"motions": rows, "summary": summary(rows)} for name, rows in found.items()}
    options.out.write_text(json.dumps(tables, indent=1) + "\n")
    print(markdown({name: table["summary"] for name, table in tables.items()}))


if __name__ == "__main__":
    main()
