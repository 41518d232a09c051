"""From the bytes of one file to the robot's motions: checked, retargeted or grounded, at one rate."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.cache import Arrays, cached, key_of
from bumblebee.motion.grounding import ground
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.human.smpl_body import model_files
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.listing import reason_of
from bumblebee.motion.reading.one_file import read_one
from bumblebee.motion.reading.settings import ReadConfig
from bumblebee.motion.reading.usable import usable
from bumblebee.motion.resample import resample
from bumblebee.motion.retarget.refit import VERSION as REFIT
from bumblebee.motion.retarget.refit import refit
from bumblebee.motion.retarget.retarget import VERSION, retarget
from bumblebee.robot.facts import IDENTITY

_READER = 3  # version of the readers, like those of the methods part of a cached result's key


@dataclass(frozen=True, eq=False)
class Job:
    """One file to be read, as it goes to another process."""

    path: Path
    """As it is shown."""
    data: bytes
    sha256: str
    csv_fps: float | None
    """Rate of this file, if it is a CSV file [Hz]."""
    cache: Path | None
    """Folder of what was retargeted before."""


@dataclass(frozen=True, eq=False)
class Ready:
    """One motion of the robot at `ReadConfig.fps`, where it stands on the floor."""

    raw: RawMotion
    amass_fps: float | None = None
    """Rate at which AMASS states to have recorded it [Hz]."""


@dataclass(frozen=True)
class Refused:
    """One motion of several in a file that cannot be used: which, and why."""

    part: str
    reason: str


def make_ready(job: Job, config: ReadConfig) -> list[Ready | Refused]:
    """The motions of a file; of several, one that is bad does not cost the others.

    Raises:
        BadInput: what is wrong in the file, or in its only motion.
    """
    # Packed with and without a cache, which keeps float32: the result must not depend on it.
    if job.cache is None:
        return _unpacked(_packed(list(_made(job, config))), job.path)
    return _unpacked(cached(job.cache, _key(job, config), lambda: _packed(list(_made(job, config)))), job.path)


def _made(job: Job, config: ReadConfig) -> Iterator[Ready | Refused]:
    motions = read_one(job.path, job.data, replace(config, csv_fps=job.csv_fps))
    for motion in motions:
        try:
            yield _one(motion, job, config)
        except BadInput as error:
            if len(motions) == 1:
                raise
            yield Refused(motion.part, reason_of(error, job.path))


def _one(motion: RawMotion | HumanMotion, job: Job, config: ReadConfig) -> Ready:
    if isinstance(motion, HumanMotion):
        rate = motion.fps if job.path.suffix.lower() == ".npz" else None
        return Ready(retarget(motion, config.fps, config.retarget), rate)
    return Ready(_on_floor(resample(usable(motion), config.fps), config))


def _on_floor(even: RawMotion, config: ReadConfig) -> RawMotion:
    """A robot's motion where it stands, as `GroundingConfig.method` says."""
    if config.grounding.method == "refit":
        return refit(even, config.grounding, config.retarget)
    pos, joints = ground(even.root_pos, even.root_quat, even.joint_pos, even.fps, config.grounding)
    return replace(even, root_pos=pos, joint_pos=joints)


def _key(job: Job, config: ReadConfig) -> str:
    """Key of everything that decides the result: the file's name and bytes, the settings, the bodies, the code."""
    parts = {
        "file": job.sha256,
        "name": job.path.name,
        "fps": config.fps,
        "csv_fps": job.csv_fps,
        "human": asdict(config.human),
        "robot": asdict(config.robot),
        "grounding": asdict(config.grounding),
        "retarget": asdict(config.retarget),
        "bodies": model_files() if job.path.suffix.lower() == ".npz" else [],
        "body": IDENTITY,
        "version": [VERSION, REFIT, _READER],
    }
    return key_of(parts)


def _packed(found: list[Ready | Refused]) -> Arrays:
    """Motions as arrays, what is said of them as JSON in bytes."""
    arrays: Arrays = {}
    about: list[dict[str, Any]] = []
    for number, one in enumerate(found):
        if isinstance(one, Refused):
            about.append({"refused": one.reason, "part": one.part})
            continue
        raw = one.raw
        for name in ("root_pos", "root_quat", "joint_pos"):
            arrays[f"{name}{number}"] = getattr(raw, name).astype(np.float32)
        said = {"name": raw.name, "fps": raw.fps, "first_row": raw.first_row, "part": raw.part}
        about.append({**said, "notes": raw.notes, "rate_from": raw.rate_from, "amass_fps": one.amass_fps})
    return arrays | {"about": np.frombuffer(json.dumps(about).encode(), np.uint8)}


def _unpacked(arrays: Arrays, path: Path) -> list[Ready | Refused]:
    found: list[Ready | Refused] = []
    for number, said in enumerate(json.loads(arrays["about"].tobytes())):
        if "refused" in said:
            found.append(Refused(said["part"], said["refused"]))
            continue
        values = [arrays[f"{name}{number}"].astype(np.float64) for name in ("root_pos", "root_quat", "joint_pos")]
        amass = said.pop("amass_fps")
        raw = RawMotion(**{**said, "notes": tuple(said["notes"])}, file=path, **_named(values))
        found.append(Ready(raw, amass))
    return found


def _named(values: list[np.ndarray]) -> dict[str, Any]:
    return dict(zip(("root_pos", "root_quat", "joint_pos"), values, strict=True))
