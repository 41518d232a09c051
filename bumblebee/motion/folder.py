"""Reads motions from a user's files: every format that is known, resampled, grounded, captioned, cut, hashed."""

import hashlib
import os
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, TypeVar

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.io.names import safe_stem
from bumblebee.io.read import read_bytes
from bumblebee.motion.captions import caption_from_name, family_of, find_captions
from bumblebee.motion.checks import check_clip, check_raw
from bumblebee.motion.clip import Clip
from bumblebee.motion.formats.asap_pickle import read_asap_pickle
from bumblebee.motion.formats.g1_csv import read_g1_csv
from bumblebee.motion.grounding import GroundingConfig, ground
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.licences import licence_of
from bumblebee.motion.naming import distinct
from bumblebee.motion.pieces import split_long
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.resample import resample
from bumblebee.motion.store import Library, read_library
from bumblebee.motion.texts import shown
from bumblebee.motion.walk import INDEX, motion_files
from bumblebee.ranges import Line, Name, Range, Ranged

Result = TypeVar("Result")

# Formats that come in such folders and are not read.
_NOT_YET = {
    ".npz": "SMPL motions cannot be read yet",
    ".npy": "NumPy arrays cannot be read yet",
    ".bvh": "BVH motions cannot be read yet",
    ".fbx": "FBX motions cannot be read yet",
    ".c3d": "C3D recordings cannot be read yet",
    ".zip": "archives cannot be read yet: unpack it",
    ".tar": "archives cannot be read yet: unpack it",
    ".gz": "archives cannot be read yet: unpack it",
    ".7z": "archives cannot be read yet: unpack it",
}
_PICKLES = (".pkl", ".pickle", ".joblib", ".p")
_END_OF_ZIP = 22 + (1 << 16)  # bytes: the record at a zip's end with the longest comment
_MAX_DIRECTORY = 16 << 20  # bytes of a zip's list of files
_UNKNOWN = "a format that is not known"


Hertz = Annotated[float, Range(least=1, most=10_000)]


@dataclass(frozen=True)
class ReadConfig(Ranged):
    """How motion files become clips."""

    csv_fps: Hertz = 60.0
    """Frame rate of CSV files, which do not say it: g1_moves 60, LAFAN1's retargets 30 [Hz]."""
    csv_fps_by_folder: dict[Name, Hertz] = field(default_factory=dict)
    """Another rate for the CSV files under a folder of that name, such as `{lafan1: 30}` [Hz]."""
    fps: Hertz = 50.0
    """Frame rate of the clips: that of the policy [Hz]."""
    max_seconds: Annotated[float, Range(least=0, most=3600)] = 10.0
    """Longer motions are cut into equal pieces `<name>_p0`, `_p1` ... no longer than this; 0 never cuts [s]."""
    captions_folder: Line = ""
    """Where `<stem>.txt` caption files lie, if not beside the motions."""
    grounding: GroundingConfig = field(default_factory=GroundingConfig)
    """Correction of motions that float or sink."""

    def __post_init__(self) -> None:
        """Refuse pieces that are shorter than any motion."""
        super().__post_init__()
        self.require(self.max_seconds == 0 or self.max_seconds >= 0.2, "max_seconds", "0, or at least 0.2")


@dataclass(frozen=True)
class Reading:
    """What a folder gave: the clips, and the files without any (`file`, `reason`)."""

    clips: list[Clip]
    skipped: pd.DataFrame


def read_folder(path: Path, config: ReadConfig | None = None, tell: Callable[[], None] | None = None) -> Reading:
    """All motions below `path`; a file that cannot be used is listed and does not stop the others.

    Args:
        path: a folder, or a single file, which must then be readable.
        config: how the files are read.
        tell: called after each file.

    Raises:
        BadInput: no such folder, or no motion in it, or the single file cannot be used.
    """
    path, config = Path(path), config or ReadConfig()
    if not path.is_dir():
        return Reading(read_file(path, config), skipped_table([]))
    files = motion_files(path)
    found: list[tuple[Path, list[Clip]]] = []
    skipped: list[tuple[str, str]] = []
    for file in files:
        for part, group in _parts(file, config):
            if isinstance(group, str):
                skipped.append((shown(os.path.relpath(part, path)), group))
            else:
                found.append((file, group))
        if tell:
            tell()
    clips = distinct(found)
    if not clips:
        first = f"; the first: {skipped[0][0]}: {skipped[0][1]}" if skipped else ""
        came = f"{len(files)} files, none of them usable{first}"
        raise BadInput(path, "G1 CSV files, ASAP pickles or a motion library", came)
    return Reading(clips, skipped_table(skipped))


def read_file(path: Path, config: ReadConfig | None = None) -> list[Clip]:
    """The clips of one file: a G1 CSV, an ASAP pickle, or the index of a motion library."""
    path, config = Path(path), config or ReadConfig()
    if path.name == INDEX:
        clips = read_library(path.parent)
        return distinct([(path, group) for group in _apart([split_long(clip, config.max_seconds) for clip in clips])])
    return distinct([(path, group) for group in _motions(path, config)])


def _parts(file: Path, config: ReadConfig) -> Iterator[tuple[Path, list[Clip] | str]]:
    """What a file of a folder gives: groups of clips whose names stay together, or the reason why there are none.

    A clip of a library counts by itself, so that a damaged one does not take the others with it.
    """
    if file.name != INDEX:
        groups = _tried(lambda: _motions(file, config), file)
        yield from [(file, groups)] if isinstance(groups, str) else [(file, group) for group in groups]
        return
    library = _tried(lambda: Library(file.parent), file)
    if isinstance(library, str):
        yield file, library
        return
    whole: list[list[Clip]] = []
    for name, clip in library.each():
        pieces = _tried(partial(_pieces, clip, config), file)
        if isinstance(pieces, str):
            yield file.parent / name, pieces
        else:
            whole.append(pieces)
    yield from ((file, group) for group in _apart(whole))


def _pieces(clip: Clip | BadInput, config: ReadConfig) -> list[Clip]:
    if isinstance(clip, BadInput):
        raise clip
    return split_long(clip, config.max_seconds)


def _tried(read: Callable[[], Result], file: Path) -> Result | str:
    """What `read` returns, or why it does not."""
    try:
        return read()
    except BadInput as error:
        return shown(_reason(error, file), 1000)
    except OSError as error:  # a file that vanished, a disk that was unplugged
        return shown(error.strerror or str(error))
    except Exception as error:  # a mistake of ours about one file must not cost the user all the others
        return shown(f"it could not be read ({type(error).__name__}: {error}): please report this")


def _apart(clips: list[list[Clip]]) -> list[list[Clip]]:
    """A library's clips as one group, or each with its pieces as its own where cutting made equal names."""
    names = [clip.name.casefold() for pieces in clips for clip in pieces]
    return [[clip for pieces in clips for clip in pieces]] if len(set(names)) == len(names) else clips


def _motions(path: Path, config: ReadConfig) -> list[list[Clip]]:
    """The pieces of each motion of a file."""
    if path.is_dir():
        came = "a link to a folder, which is not followed" if path.is_symlink() else "one that cannot be listed"
        raise BadInput(path, "a folder with motions", came)
    suffix = path.suffix.lower()
    if suffix not in (*_PICKLES, ".csv"):
        reason = _inside_zip(path) if suffix == ".zip" else _NOT_YET.get(suffix, _UNKNOWN)
        if not os.path.lexists(path):
            raise BadInput(path, "a folder with motion files, or a motion file", "no such folder or file")
        raise BadInput(path, "a G1 CSV file, an ASAP pickle or a motion library", reason)
    data = read_bytes(path)
    digest = hashlib.sha256(data).hexdigest()
    is_csv = suffix == ".csv"
    raws = [read_g1_csv(path, _csv_fps(path, config), data)] if is_csv else read_asap_pickle(path, data)
    return [prepare(raw, config, digest) for raw in raws]


def prepare(raw: RawMotion, config: ReadConfig, digest: str = "") -> list[Clip]:
    """Checked, resampled, grounded, captioned, cut: what becomes of a motion once it is read."""
    check_raw(raw)
    raw = resample(raw, config.fps)
    root_pos, joint_pos = ground(raw.root_pos, raw.root_quat, raw.joint_pos, raw.fps, config.grounding)
    captions, source = find_captions(raw.file, config.captions_folder), "file"
    if not captions:
        captions, source = (caption_from_name(raw.name),), "name"
    clip = make_clip(
        safe_stem(raw.name, "motion"),
        raw.fps,
        root_pos,
        raw.root_quat,
        joint_pos,
        captions=captions,
        caption_source=source,
        source=shown(str(Path(raw.file.parent.name) / raw.file.name)),
        licence=licence_of(raw.file),
        sha256=digest,
        family=family_of(raw.name),
    )
    check_clip(raw.where, clip)
    return split_long(clip, config.max_seconds)


def _inside_zip(path: Path) -> str:
    """Why an archive is skipped, with what it holds."""
    reason = _NOT_YET[".zip"]
    try:
        if not path.is_file() or not _short_directory(path):
            return reason
        with zipfile.ZipFile(path) as archive:
            kinds = Counter(shown(Path(name).suffix.lower(), 12) for name in archive.namelist())
    except Exception:  # zipfile raises anything from BadZipFile to NotImplementedError for a damaged directory
        return reason
    kinds.pop("", None)
    if not kinds:
        return reason
    kind, count = kinds.most_common(1)[0]
    return f"{reason} ({count} {kind} files in it" + (f"; {_NOT_YET[kind]})" if kind in _NOT_YET else ")")


def _short_directory(path: Path) -> bool:
    """Whether an archive's list of files is small enough to look into: its length stands at the file's end."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        stream.seek(max(0, size - _END_OF_ZIP))
        end = stream.read(_END_OF_ZIP)
    at = end.rfind(b"PK\x05\x06")
    return at >= 0 and len(end) >= at + 16 and int.from_bytes(end[at + 12 : at + 16], "little") <= _MAX_DIRECTORY


def _csv_fps(path: Path, config: ReadConfig) -> float:
    for folder in Path(os.path.realpath(path)).parents:
        if folder.name in config.csv_fps_by_folder:
            return config.csv_fps_by_folder[folder.name]
    return config.csv_fps


def _reason(error: BadInput, file: Path) -> str:
    """The error's line without the file's name, which stands in a column of its own."""
    if error.came.startswith(tuple(_NOT_YET.values())) or error.came == _UNKNOWN:
        return error.came
    return str(error).removeprefix(str(file)).lstrip(":, ")


def skipped_table(rows: list[tuple[str, str]]) -> pd.DataFrame:
    """Files without clips, columns `file` and `reason`."""
    return pd.DataFrame(rows, columns=["file", "reason"])
