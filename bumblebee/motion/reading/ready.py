"""From the bytes of each file to the robot's motions: checked, retargeted or grounded, at one rate."""

import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.cache import Arrays, cached, key_of
from bumblebee.motion.grounding import ground
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.human.smpl_body import model_files
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.file import File, reason_of, tried
from bumblebee.motion.reading.files import clips_of, opened
from bumblebee.motion.reading.one_file import read_one
from bumblebee.motion.reading.settings import ReadConfig
from bumblebee.motion.reading.usable import usable
from bumblebee.motion.resample import resample
from bumblebee.motion.retarget.refit import VERSION as REFIT
from bumblebee.motion.retarget.refit import refit
from bumblebee.motion.retarget.retarget import VERSION, retarget
from bumblebee.motion.side_by_side import in_order
from bumblebee.robot.facts import IDENTITY

_READER = 3  # version of the readers, like those of the methods part of a cached result's key
_ARRAYS = ("root_pos", "root_quat", "joint_pos")
Made = RawMotion | tuple[str, str]
"""A motion of the robot at `ReadConfig.fps`, where it stands on the floor; or which cannot be used, and why."""


def each_file(path: Path, config: ReadConfig, cache: Path | None) -> Iterator[File]:
    """Each file at or below `path` with the robot's motions in it, in order; several processes work on them.

    Args:
        path: a file, a folder or a motion library, of which each clip comes by itself and as it is.
        config: how the files are read.
        cache: folder of what was retargeted before.
    """
    for file in in_order(partial(_read, config=config, cache=cache), opened(path, config), config.processes):
        yield from clips_of(file) if file.library else [file]


def _read(file: File, config: ReadConfig, cache: Path | None) -> File:
    """The file with its motions in the place of its bytes; never raises."""
    if file.reason or file.library:
        return file
    found = tried(partial(make_ready, file, config, cache), file.path)
    file = replace(file, data=b"")
    if isinstance(found, str):
        return replace(file, reason=found)
    motions = tuple(one for one in found if isinstance(one, RawMotion))
    refused = tuple(one for one in found if isinstance(one, tuple))
    return replace(file, motions=motions, refused=refused, reason="" if found else "no motion in it")


def make_ready(file: File, config: ReadConfig, cache: Path | None) -> list[Made]:
    """The motions of a file; of several, one that is bad does not cost the others.

    Raises:
        BadInput: what is wrong in the file, or in its only motion.
    """
    # Packed with and without a cache, which keeps float32: the result must not depend on it.
    if cache is None:
        return _unpacked(_packed(list(_made(file, config))), file.path)
    return _unpacked(cached(cache, _key(file, config), lambda: _packed(list(_made(file, config)))), file.path)


def _made(file: File, config: ReadConfig) -> Iterator[Made]:
    motions = read_one(file.path, file.data, replace(config, csv_fps=file.csv_fps))
    for motion in motions:
        try:
            yield _one(motion, file, config)
        except BadInput as error:
            if len(motions) == 1:
                raise
            yield motion.part, reason_of(error, file.path)


def _one(motion: RawMotion | HumanMotion, file: File, config: ReadConfig) -> RawMotion:
    if isinstance(motion, HumanMotion):
        recorded = motion.fps if file.path.suffix.lower() == ".npz" else None
        return replace(retarget(motion, config.fps, config.retarget), amass_fps=recorded)
    return _on_floor(resample(usable(motion), config.fps), config)


def _on_floor(even: RawMotion, config: ReadConfig) -> RawMotion:
    """A robot's motion where it stands, as `GroundingConfig.method` says."""
    if config.grounding.method == "refit":
        return refit(even, config.grounding, config.retarget)
    pos, joints = ground(even.root_pos, even.root_quat, even.joint_pos, even.fps, config.grounding)
    return replace(even, root_pos=pos, joint_pos=joints)


def _key(file: File, config: ReadConfig) -> str:
    """Key of everything that decides the result: the file's name and bytes, the settings, the bodies, the code."""
    parts = {
        "file": file.sha256,
        "name": file.path.name,
        "fps": config.fps,
        "csv_fps": file.csv_fps,
        "human": asdict(config.human),
        "robot": asdict(config.robot),
        "grounding": asdict(config.grounding),
        "retarget": asdict(config.retarget),
        "bodies": model_files() if file.path.suffix.lower() == ".npz" else [],
        "body": IDENTITY,
        "version": [VERSION, REFIT, _READER],
    }
    return key_of(parts)


def _packed(found: list[Made]) -> Arrays:
    """Motions as arrays, what is said of them as JSON in bytes."""
    arrays: Arrays = {}
    about: list[dict[str, Any]] = []
    for number, raw in enumerate(found):
        if isinstance(raw, tuple):
            about.append({"part": raw[0], "refused": raw[1]})
            continue
        for name in _ARRAYS:
            arrays[f"{name}{number}"] = getattr(raw, name).astype(np.float32)
        said = {"name": raw.name, "fps": raw.fps, "first_row": raw.first_row, "part": raw.part}
        about.append({**said, "notes": raw.notes, "rate_from": raw.rate_from, "amass_fps": raw.amass_fps})
    return arrays | {"about": np.frombuffer(json.dumps(about).encode(), np.uint8)}


def _unpacked(arrays: Arrays, path: Path) -> list[Made]:
    found: list[Made] = []
    for number, said in enumerate(json.loads(arrays["about"].tobytes())):
        if "refused" in said:
            found.append((said["part"], said["refused"]))
            continue
        values: dict[str, Any] = {name: arrays[f"{name}{number}"].astype(np.float64) for name in _ARRAYS}
        found.append(RawMotion(**{**said, "notes": tuple(said["notes"])}, file=path, **values))
    return found
