"""Motions of any format that is read, written in one that other trainers take, with the licence of each."""

import itertools
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.write import new_folder, refuse_entering, try_output
from bumblebee.motion.clip import Clip
from bumblebee.motion.describe.describer import beside
from bumblebee.motion.formats.write import FORMATS, write_motion
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.licences.table import LICENCES, Stated, read_table, table_of
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.clips import clip_of
from bumblebee.motion.reading.file import File, Motion, reason_of
from bumblebee.motion.reading.files import find_motions
from bumblebee.motion.reading.naming import Names
from bumblebee.motion.reading.nothing import nothing
from bumblebee.motion.reading.one_file import FileConfig
from bumblebee.motion.reading.usable import usable
from bumblebee.motion.reading.walk import INDEX
from bumblebee.motion.resample import resample
from bumblebee.motion.retarget.retarget import retarget
from bumblebee.motion.store import write_library
from bumblebee.motion.texts import shown

LIBRARY = "library"
KINDS = (*FORMATS, LIBRARY)
_LIBRARY_FPS = 50.0  # Hz: the policy's
_OWN = {INDEX, "clips", "skipped.csv"}  # names in a library


@dataclass(frozen=True)
class ConvertConfig:
    """Settings of a conversion: what is written."""

    to: str
    """One of `KINDS`."""
    fps: float | None = None
    """Rate of what is written [Hz]; None: each motion's own, 50 for mjlab and libraries."""
    files: FileConfig = field(default_factory=FileConfig)
    """Settings that the files may leave unsaid."""

    @property
    def rate(self) -> float | None:
        """The rate of all that is written, None where each motion keeps its own [Hz]."""
        given = _LIBRARY_FPS if self.to == LIBRARY else FORMATS[self.to].fps
        return self.fps or given


@dataclass
class Converted:
    """Outcome of a conversion."""

    written: int = 0
    files: int = 0
    skipped: list[tuple[str, str]] = field(default_factory=list)
    """Files and motions that gave nothing: place, reason."""
    notes: list[tuple[str, str]] = field(default_factory=list)
    """Facts detected and not stated in the written motions, and captions that were not used: place, note."""
    rates: set[float] = field(default_factory=set)


def convert(
    path: Path,
    out: Path,
    config: ConvertConfig,
    overwrite: bool = False,
    tell: Callable[[str], None] | None = None,
) -> Converted:
    """Write the motions at `path` into the folder `out`, which appears whole or not at all.

    Args:
        path: a file, a folder or a motion library.
        out: a new folder, or with `overwrite` an earlier result.
        config: format and rate.
        overwrite: replace an earlier result.
        tell: called with a line for each file or motion that gives nothing.

    Raises:
        BadInput: `out` is an input or somebody else's; nothing could be written.
    """
    claim(out, path, config.to, overwrite)
    done = Converted()
    clips = _clips(path, config, done, lambda place, reason: tell(f"{place}: {reason}") if tell else None)
    first = next(clips, None)
    if first is None:
        raise nothing(path, "a motion of the robot", done.skipped)
    counted = _counted(itertools.chain([first], clips), done)
    if config.to == LIBRARY:
        write_library(out, counted)
    else:
        _write(out, counted, config)
    return done


def claim(out: Path, path: Path, to: str, overwrite: bool) -> None:
    """See that a result may be written at `out`, and that the disk takes it, before the work; else `BadInput`."""
    refuse_entering(out, [path])
    try_output(out)
    if not os.path.lexists(out):
        return
    if out.is_symlink() or not out.is_dir() or (os.listdir(out) and not _ours(out, to)):
        raise BadInput(out, "a new folder, or converted motions to replace", "something else", "Choose another name.")
    if os.listdir(out) and not overwrite:
        came = "motions that were converted before"
        raise BadInput(out, "a folder that does not exist yet", came, "Add --overwrite to replace it.")


def _ours(out: Path, to: str) -> bool:
    """Whether a folder holds an earlier result of the same kind, and nothing else."""
    names = set(os.listdir(out))
    if to == LIBRARY:
        return INDEX in names and names <= _OWN
    written = read_table(out)
    return bool(written) and names <= {LICENCES, *written}


def noted_clip(raw: RawMotion, fps: float | None, file: File | None = None) -> tuple[Clip, tuple[str, ...]]:
    """A motion of the robot, checked and at another rate, as a clip, and the notes on it and its captions.

    Heights stay as they are.

    Raises:
        BadInput: a check that it fails.
    """
    raw = usable(raw)
    raw = resample(raw, fps or raw.fps)
    texts = beside(raw.file, (len(raw.root_pos) - 1) / raw.fps)
    return clip_of(raw, file or File(raw.file), texts), (*raw.notes, *texts.notes)


def clips_at(
    path: Path, files: FileConfig, tell: Callable[[str, str], None], fps: float | None = None
) -> Iterator[tuple[Clip, list[tuple[str, str]]]]:
    """The motions at `path` as clips at `fps` [Hz], or their own rates, under distinct names, with notes (place, note).

    `tell` gets place and reason of what gives none.
    """
    done = Converted()
    for clip in _clips(path, ConvertConfig("asap", fps, files), done, tell):
        yield clip, done.notes
        done.notes = []


def _clips(path: Path, config: ConvertConfig, done: Converted, tell: Callable[[str, str], None]) -> Iterator[Clip]:
    """The motions that can be written, one after the other, under distinct names; `done` gets what is said of them."""
    names = Names()

    def skip(place: str, reason: str) -> None:
        done.skipped.append((place, reason))
        tell(place, reason)

    for found in find_motions(path, config.files):
        done.files += 1
        place = shown(os.path.relpath(found.path, path) if Path(path).is_dir() else str(found.path))
        if not found.motions:
            skip(place, found.reason or "no motion in it")
        for motion in found.motions:
            try:
                clip, notes = _clip(motion, found, config)
            except BadInput as error:
                skip(
                    f"{place}, {shown(motion.name)}" if len(found.motions) > 1 else place, reason_of(error, found.path)
                )
                continue
            done.notes += [(place, note) for note in notes]
            yield replace(clip, name=names.distinct(clip.name, found.path.parent.name))


def _clip(motion: Motion, file: File, config: ConvertConfig) -> tuple[Clip, tuple[str, ...]]:
    if isinstance(motion, HumanMotion):
        motion = retarget(motion, config.rate or _LIBRARY_FPS)
    if isinstance(motion, RawMotion):
        return noted_clip(motion, config.rate, file)
    if config.rate is None or config.rate == motion.fps:
        return motion, ()
    raw = RawMotion(motion.name, motion.fps, motion.root_pos, motion.root_quat, motion.joint_pos, file.path)
    moved = resample(raw, config.rate)
    about = {name: getattr(motion, name) for name in ("captions", "source", "licence", "sha256", "family", "split")}
    about["caption_source"] = motion.caption_source
    return make_clip(motion.name, moved.fps, moved.root_pos, moved.root_quat, moved.joint_pos, **about), ()


def _counted(clips: Iterable[Clip], done: Converted) -> Iterator[Clip]:
    for clip in clips:
        done.written += 1
        done.rates.add(clip.fps)
        yield clip


def _write(out: Path, clips: Iterable[Clip], config: ConvertConfig) -> None:
    rows: list[Stated] = []
    rate = None
    with new_folder(out) as folder:
        for clip in clips:
            rate = rate or clip.fps
            if not FORMATS[config.to].holds_rate and clip.fps != rate:
                came = f"{rate:g} and {clip.fps:g} Hz ({clip.name})"
                raise BadInput(out, "one rate for files that hold none", came, f"Say it: --fps {rate:g}.")
            file = write_motion(folder, clip, config.to)
            rows.append(Stated(file.name, clip.name, clip.fps, clip.source, clip.licence))
        (folder / LICENCES).write_text(table_of(rows), encoding="utf-8")
