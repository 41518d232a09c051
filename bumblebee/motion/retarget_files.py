"""Motions of people onto any humanoid, written as files that say what they hold."""

import io
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.names import safe_stem
from bumblebee.io.write import new_folder, write_file
from bumblebee.motion.formats.convert import Converted, claim
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.licences.table import LICENCES, Stated, table_of
from bumblebee.motion.reading.file import reason_of
from bumblebee.motion.reading.files import find_motions
from bumblebee.motion.reading.naming import Names
from bumblebee.motion.reading.nothing import nothing
from bumblebee.motion.reading.one_file import FileConfig
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import Robot, read_robot, this_robot
from bumblebee.motion.retarget.retarget import aim, fit, fit_notes, root_quat
from bumblebee.motion.side_by_side import in_order
from bumblebee.motion.texts import shown
from bumblebee.ranges import Range, Ranged


@dataclass(frozen=True)
class RobotFiles(Ranged):
    """Onto which robot, and how it is written."""

    model: Path | None = None
    """Its MJCF; None: the G1."""
    mapping: Path | None = None
    """Its mapping, with a model only."""
    fps: Annotated[float, Range(least=5, most=1000)] = 50.0
    """Rate of what is written [Hz]."""
    to: Literal["npz", "csv"] = "npz"
    """`.npz` with named arrays, or CSV with a header."""
    files: FileConfig = field(default_factory=FileConfig)
    """Settings that the people's files may leave unsaid."""


@dataclass(frozen=True)
class _Job:
    """One person, or why there is none."""

    place: str
    source: str = ""
    licence: str = ""
    motion: HumanMotion | None = None
    reason: str = ""
    first: bool = True
    """Whether it is the first of its file."""


@dataclass(frozen=True)
class _Done:
    """The content of one file, or why there is none."""

    job: _Job
    content: bytes = b""
    reason: str = ""


def retarget_files(
    path: Path, out: Path, config: RobotFiles, overwrite: bool = False, tell: Callable[[str, int], None] | None = None
) -> Converted:
    """Write the people at `path` on a robot into the folder `out`, which appears whole or not at all.

    Args:
        path: a file, a folder or an archive.
        out: a new folder, or with `overwrite` an earlier result.
        config: robot, rate and format.
        overwrite: replace an earlier result.
        tell: called for each motion with why it gives nothing, "" where it gives something, and the motions so far.

    Raises:
        BadInput: the robot cannot be used; `out` is an input or somebody else's; nothing could be written.
    """
    if (config.model is None) != (config.mapping is None):
        raise BadInput("--model", "an MJCF and its --mapping", "one without the other")
    _robot(config.model, config.mapping)
    claim(out, path, config.to, overwrite)
    done, names, rows = Converted(), Names(), []
    with new_folder(out) as folder:
        for count, made in enumerate(in_order(partial(_made, config=config), _jobs(path, config)), 1):
            job = made.job
            done.files += job.first
            if made.reason:
                done.skipped.append((job.place, made.reason))
            else:
                name = names.distinct(safe_stem(job.motion.name if job.motion else "", "motion"), Path(job.place).stem)
                write_file(folder / f"{name}.{config.to}", made.content)
                rows.append(Stated(f"{name}.{config.to}", name, config.fps, job.source, job.licence))
                done.notes += [(job.place, note) for note in (job.motion.notes if job.motion else ())]
                done.written += 1
                done.rates.add(config.fps)
            if tell:
                tell(f"{job.place}: {made.reason}" if made.reason else "", count)
        if not rows:
            raise nothing(path, "a motion of a person", done.skipped)
        (folder / LICENCES).write_text(table_of(rows), encoding="utf-8")
    return done


def _jobs(path: Path, config: RobotFiles) -> Iterator[_Job]:
    for found in find_motions(path, config.files):
        place = shown(os.path.relpath(found.path, path) if Path(path).is_dir() else str(found.path))
        if not found.motions:
            yield _Job(place, reason=found.reason or "no motion in it")
        for number, motion in enumerate(found.motions):
            where = f"{place}, {shown(motion.name)}" if len(found.motions) > 1 else place
            if isinstance(motion, HumanMotion):
                yield _Job(where, found.source, found.licence, motion, first=not number)
            else:
                came = "expected a motion of a person, came one of the G1: `bumblebee motions convert` writes those"
                yield _Job(where, reason=came, first=not number)


def _made(job: _Job, config: RobotFiles) -> _Done:
    """The file of one person; never raises."""
    if job.motion is None:
        return _Done(job, reason=job.reason)
    robot = _robot(config.model, config.mapping)
    try:
        content, notes = content_of(job.motion, robot, config)
        return _Done(replace(job, motion=replace(job.motion, notes=(*job.motion.notes, *notes))), content)
    except BadInput as error:
        return _Done(job, reason=reason_of(error, job.motion.file))
    except Exception as error:  # a mistake of ours about one motion must not cost the user all the others
        return _Done(job, reason=shown(f"it failed ({type(error).__name__}: {error}): please report this"))


@lru_cache(maxsize=1)
def _robot(model: Path | None, mapping: Path | None) -> Robot:
    """Read once in each process: a model with meshes is large."""
    return read_robot(model, mapping) if model is not None and mapping is not None else this_robot()


def content_of(motion: HumanMotion, robot: Robot, config: RobotFiles) -> tuple[bytes, tuple[str, ...]]:
    """A person on a robot as the bytes of a file, and notes on where its motion is another than the person's.

    `.npz`: `fps` (1,) [Hz], `root_pos` (T, 3) [m], `root_quat_wxyz` (T, 4), `joint_pos` (T, n) [rad], `joint_names`
    (n,) in the MJCF's order, `robot`. CSV: `time` [s], `root_x`, `root_y`, `root_z` [m], `root_qw` to `root_qz`, then
    the joints [rad] by name.
    """
    settings = RetargetConfig()
    target = aim(motion, robot, config.fps, settings)
    at = fit(target, robot, settings)
    notes = fit_notes(at, target, robot, settings)
    if config.to == "csv":
        head = ["time", *(f"root_{c}" for c in ("x", "y", "z", "qw", "qx", "qy", "qz")), *robot.tree.joints]
        table = np.c_[np.arange(len(at.root)) / config.fps, at.root, root_quat(at), at.joint]
        text = io.StringIO()
        np.savetxt(text, table, fmt="%.9g", delimiter=",", header=",".join(map(_cell, head)), comments="")
        return text.getvalue().encode(), notes
    stream = io.BytesIO()
    arrays = {"root_pos": at.root, "root_quat_wxyz": root_quat(at), "joint_pos": at.joint}
    np.savez(
        stream,
        fps=np.array([config.fps]),
        joint_names=np.array(robot.tree.joints),
        robot=np.array(robot.name),
        **{name: values.astype(np.float32) for name, values in arrays.items()},  # type: ignore[arg-type]
    )
    return stream.getvalue(), notes


def _cell(name: str) -> str:
    """A joint's name as a cell of a CSV header."""
    quoted = name.replace('"', '""')
    return f'"{quoted}"' if any(sign in name for sign in ',"\n\r') else name
