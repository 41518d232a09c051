"""A folder or a zip archive as named files to read; archives are read in place and nothing is extracted to disk."""

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.io.names import distinct_stems
from bumblebee.io.read import decode, member_bytes, members, npz_arrays, open_file, read_bytes

LOGS = Limits(ratio=200.0)
"""Limits of logs: numbers that were measured have noise and pack ten times, not two hundred times."""


@dataclass(frozen=True)
class Source:
    """Files under a folder or in an archive; names are relative, with forward slashes."""

    place: Path
    names: tuple[str, ...]
    limits: Limits = LOGS

    def read(self, name: str) -> bytes:
        """The bytes of one file."""
        if not _is_archive(self.place):
            return read_bytes(self.place / name if self.place.is_dir() else self.place, self.limits.file_bytes)
        where = self.where(name)
        try:
            with zipfile.ZipFile(self.place) as archive:
                return member_bytes(where, archive, archive.getinfo(name), self.limits)
        except (zipfile.BadZipFile, OSError, KeyError, ValueError) as error:
            raise BadInput(where, "a file that unpacks", str(error)) from None

    def read_text(self, name: str) -> str:
        """The text of one small file."""
        data = self.read(name)
        if len(data) > self.limits.text_bytes:
            raise BadInput(self.where(name), f"at most {self.limits.text_bytes:,} bytes", f"{len(data):,}")
        return decode(self.where(name), data)

    def where(self, name: str) -> str:
        """How a message names the file."""
        return str(self.place) if self.place.name == name else f"{self.place}/{name}"

    def ending(self, suffix: str) -> list[str]:
        """Names that end so, sorted."""
        return sorted(name for name in self.names if name.lower().endswith(suffix))


def open_source(place: Path, limits: Limits = LOGS) -> Source:
    """A folder, a zip archive or a single file.

    Raises:
        BadInput: where there is nothing, or an archive is damaged, too large, or holds names that lead out of it.
    """
    place = Path(place)
    try:
        if place.is_dir():
            inside = (path for path in place.rglob("*") if path.is_file())
            names = sorted(path.relative_to(place).as_posix() for path in inside)
            if len(names) > limits.members:
                raise BadInput(place, f"at most {limits.members:,} files", f"{len(names):,}")
            return Source(place, tuple(names), limits)
        if not place.is_file():
            raise BadInput(place, "a folder or a file", "neither")
    except (OSError, ValueError) as error:  # no permission, a name too long, a NUL in it
        raise BadInput(place, "a folder or a file", str(error)) from None
    if not _is_archive(place):
        return Source(place, (place.name,), limits)
    try:
        open_file(place, place.stat().st_size).close()
        with zipfile.ZipFile(place) as archive:
            names = [info.filename for info in members(place, archive, limits)]
    except BadInput:
        raise
    except Exception as error:  # a damaged directory raises anything from BadZipFile to struct.error
        raise BadInput(place, "a zip archive", f"bytes that are not one ({error})") from None
    for name in names:
        parts = PurePosixPath(name.replace("\\", "/"))
        if not parts.parts or parts.is_absolute() or ".." in parts.parts or ":" in parts.parts[0]:
            raise BadInput(f"{place}: {name}", "names inside the archive", "a name that leads out of it")
    return Source(place, tuple(sorted(set(names))), limits)


def _is_archive(place: Path) -> bool:
    """By its name: an .npz file is a zip archive inside, too, but one log."""
    return place.suffix.lower() == ".zip" and place.is_file()


def read_arrays(source: Source, name: str) -> dict[str, np.ndarray]:
    """The arrays of an .npz file; pickled objects in it are refused, never run."""
    where, data = source.where(name), source.read(name)
    if not zipfile.is_zipfile(io.BytesIO(data)):
        raise BadInput(where, "an .npz file of plain arrays", f"{len(data):,} bytes that are none")
    return npz_arrays(where, data, source.limits)


NO_VELOCITY = "joint_vel was not logged: differences of the positions"


def rollout_names(names: list[str], suffix: str) -> dict[str, str]:
    """File name -> rollout id: the stem where the stems differ, the whole path with underscores where not."""
    stems = [PurePosixPath(name).name[: -len(suffix)] for name in names]
    if len({stem.casefold() for stem in stems}) < len(stems):
        stems = [name[: -len(suffix)] for name in names]
    return dict(zip(names, distinct_stems(stems, "rollout"), strict=True))


def differences(time: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Velocities (T, J) where a log has none: central differences of the positions (T, J) over the stamps (T,)."""
    if len(time) < 2:
        return np.zeros_like(place)
    with np.errstate(all="ignore"):
        return np.gradient(place, time, axis=0)


def measured_rate(time: np.ndarray) -> float:
    """Rate [Hz] from the median period, to four digits; 1 where the stamps do not increase."""
    with np.errstate(all="ignore"):
        period = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    return float(f"{1 / period:.4g}") if np.isfinite(period) and 1e-5 < period < 1e5 else 1.0
