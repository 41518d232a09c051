"""Reads motions from a user's files: every format that is known, resampled, grounded, captioned, cut, hashed."""

import hashlib
import os
import re
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.motion.asap_pickle import read_asap_pickle
from bumblebee.motion.captions import caption_from_name, family_of, find_captions
from bumblebee.motion.checks import check_raw
from bumblebee.motion.clip import Clip
from bumblebee.motion.g1_csv import read_g1_csv
from bumblebee.motion.grounding import GroundingConfig, ground
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.licences import licence_of
from bumblebee.motion.pieces import motion_of, split_long
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.resample import resample
from bumblebee.motion.store import read_library
from bumblebee.ranges import Line, Name, Range, Ranged

# Formats that come in such folders and are not read; what is no motion at all (notes, licences) is passed over.
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
_UNKNOWN = "a format that is not known"
_NO_MOTION = {"", ".txt", ".md", ".pdf", ".png", ".jpg", ".gif", ".mp4", ".html", ".json", ".yaml", ".yml", ".py"}


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
    if path.is_file():
        return Reading(read_file(path, config), skipped_table([]))
    if not path.is_dir():
        raise BadInput(path, "a folder with motion files", "no such folder")
    files = motion_files(path)
    found: list[tuple[Path, list[Clip]]] = []
    skipped: list[tuple[str, str]] = []
    for file in files:
        try:
            found.append((file, read_file(file, config)))
        except BadInput as error:
            skipped.append((str(file.relative_to(path)), _reason(error, file)))
        except OSError as error:
            skipped.append((str(file.relative_to(path)), error.strerror or str(error)))
        if tell:
            tell()
    clips = _distinct(found)
    if not clips:
        first = f"; the first: {skipped[0][0]}: {skipped[0][1]}" if skipped else ""
        came = f"{len(files)} files, none of them usable{first}"
        raise BadInput(path, "G1 CSV files, ASAP pickles or a motion library", came)
    return Reading(clips, skipped_table(skipped))


def read_file(path: Path, config: ReadConfig | None = None) -> list[Clip]:
    """The clips of one file: a G1 CSV, an ASAP pickle, or the index of a motion library."""
    path, config = Path(path), config or ReadConfig()
    if path.name == "index.parquet":
        return [piece for clip in read_library(path.parent) for piece in split_long(clip, config.max_seconds)]
    if not path.is_file():
        raise BadInput(path, "a motion file", "no such file")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return [piece for raw in _raw(path, config) for piece in prepare(raw, config, digest)]


def prepare(raw: RawMotion, config: ReadConfig, digest: str = "") -> list[Clip]:
    """Checked, resampled, grounded, captioned, cut: what becomes of a motion once it is read."""
    check_raw(raw)
    raw = resample(raw, config.fps)
    root_pos, joint_pos = ground(raw.root_pos, raw.root_quat, raw.joint_pos, raw.fps, config.grounding)
    captions, source = find_captions(raw.file, config.captions_folder), "file"
    if not captions:
        captions, source = (caption_from_name(raw.name),), "name"
    clip = make_clip(
        _file_name(raw.name),
        raw.fps,
        root_pos,
        raw.root_quat,
        joint_pos,
        captions=captions,
        caption_source=source,
        source=str(Path(raw.file.parent.name) / raw.file.name),
        licence=licence_of(raw.file),
        sha256=digest,
        family=family_of(raw.name),
    )
    return split_long(clip, config.max_seconds)


def _raw(path: Path, config: ReadConfig) -> list[RawMotion]:
    suffix = path.suffix.lower()
    if suffix in (".pkl", ".pickle", ".joblib", ".p"):
        return read_asap_pickle(path)
    if suffix == ".csv":
        return [read_g1_csv(path, _csv_fps(path, config))]
    reason = _inside_zip(path) if suffix == ".zip" else _NOT_YET.get(suffix, _UNKNOWN)
    raise BadInput(path, "a G1 CSV file, an ASAP pickle or a motion library", reason)


def _inside_zip(path: Path) -> str:
    """Why an archive is skipped, with what it holds."""
    reason = _NOT_YET[".zip"]
    try:
        with zipfile.ZipFile(path) as archive:
            kinds = Counter(Path(name).suffix.lower() for name in archive.namelist())
    except (zipfile.BadZipFile, OSError, ValueError):
        return reason
    kinds.pop("", None)
    if not kinds:
        return reason
    kind, count = kinds.most_common(1)[0]
    return f"{reason} ({count} {kind} files in it" + (f"; {_NOT_YET[kind]})" if kind in _NOT_YET else ")")


def _csv_fps(path: Path, config: ReadConfig) -> float:
    for folder in path.resolve().parents:
        if folder.name in config.csv_fps_by_folder:
            return config.csv_fps_by_folder[folder.name]
    return config.csv_fps


def motion_files(path: Path) -> list[Path]:
    """The files that `read_folder` tries, in its order."""
    return [path] if path.is_file() else list(_walk(path))


def _walk(folder: Path) -> Iterator[Path]:
    """The motion files below a folder, sorted; a motion library counts as one file, its index."""
    for place, below, names in os.walk(folder):
        below[:] = sorted(name for name in below if not name.startswith("."))
        if "index.parquet" in names and "clips" in below:
            below.clear()
            yield Path(place) / "index.parquet"
            continue
        for name in sorted(names):
            if not name.startswith(".") and Path(name).suffix.lower() not in _NO_MOTION:
                yield Path(place) / name


def _reason(error: BadInput, file: Path) -> str:
    """The error's line without the file's name, which stands in a column of its own."""
    if error.came.startswith(tuple(_NOT_YET.values())) or error.came == _UNKNOWN:
        return error.came
    return str(error).removeprefix(str(file)).lstrip(":, ")


def skipped_table(rows: list[tuple[str, str]]) -> pd.DataFrame:
    """Files without clips, columns `file` and `reason`."""
    return pd.DataFrame(rows, columns=["file", "reason"])


def _distinct(found: list[tuple[Path, list[Clip]]]) -> list[Clip]:
    """Names that occur in several files get the folder's name in front, and a number if that is not enough."""
    taken: set[str] = set()
    clips: list[Clip] = []
    for file, group in found:
        names = [clip.name for clip in group]
        if taken & set(names):
            names = [f"{_file_name(file.parent.name)}_{name}" for name in names]
        first, number = names, 2
        while taken & set(names):
            names = [_numbered(name, number) for name in first]
            number += 1
        taken |= set(names)
        clips += [replace(clip, name=name) for clip, name in zip(group, names, strict=True)]
    return clips


def _numbered(name: str, number: int) -> str:
    """`walk_p3` -> `walk_2_p3`: the piece stays at the end."""
    motion = motion_of(name)
    return f"{motion}_{number}{name[len(motion) :]}"


def _file_name(name: str) -> str:
    """A name that is safe as a file's."""
    return re.sub(r"[^A-Za-z0-9_.+-]+", "_", name).strip("._") or "motion"
