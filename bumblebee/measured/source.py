"""A folder or a zip archive as named files to read; archives are read in place and nothing is extracted to disk."""

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from bumblebee.errors import BadInput

LARGEST = 1 << 30  # bytes of one file in an archive, unpacked; a log is a thousand times smaller


@dataclass(frozen=True)
class Source:
    """Files under a folder or in an archive; names are relative, with forward slashes."""

    place: Path
    names: tuple[str, ...]

    def read(self, name: str) -> bytes:
        """The bytes of one file."""
        if self.place.is_dir():
            return (self.place / name).read_bytes()
        if not _is_archive(self.place):
            return self.place.read_bytes()
        with zipfile.ZipFile(self.place) as archive:
            info = archive.getinfo(name)
            if info.file_size > LARGEST:
                raise BadInput(f"{self.place}: {name}", f"at most {LARGEST} bytes", str(info.file_size))
            try:
                with archive.open(info) as stream:
                    return stream.read(info.file_size + 1)
            except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError) as error:
                raise BadInput(f"{self.place}: {name}", "a file that unpacks", str(error)) from None

    def where(self, name: str) -> str:
        """How a message names the file."""
        return str(self.place) if self.place.name == name else f"{self.place}/{name}"

    def ending(self, suffix: str) -> list[str]:
        """Names that end so, sorted."""
        return sorted(name for name in self.names if name.lower().endswith(suffix))


def open_source(place: Path) -> Source:
    """A folder, a zip archive or a single file.

    Raises:
        BadInput: where there is nothing, or an archive is damaged or holds names that lead out of it.
    """
    place = Path(place)
    if place.is_dir():
        inside = (path for path in place.rglob("*") if path.is_file())
        return Source(place, tuple(sorted(path.relative_to(place).as_posix() for path in inside)))
    if not place.is_file():
        raise BadInput(place, "a folder or a file", "neither")
    if not _is_archive(place):
        return Source(place, (place.name,))
    try:
        with zipfile.ZipFile(place) as archive:
            names = [info.filename for info in archive.infolist() if not info.is_dir()]
    except (zipfile.BadZipFile, OSError) as error:
        raise BadInput(place, "a zip archive", f"{place.stat().st_size} bytes that are not one ({error})") from None
    for name in names:
        parts = PurePosixPath(name.replace("\\", "/"))
        if parts.is_absolute() or ".." in parts.parts or ":" in parts.parts[0]:
            raise BadInput(f"{place}: {name}", "names inside the archive", "a name that leads out of it")
    return Source(place, tuple(sorted(names)))


def _is_archive(place: Path) -> bool:
    """By its name: an .npz file is a zip archive inside, too, but one log."""
    return place.suffix.lower() == ".zip"


def read_arrays(source: Source, name: str) -> dict[str, np.ndarray]:
    """The arrays of an .npz file; pickled objects in it are refused, never run."""
    where = source.where(name)
    try:
        with np.load(io.BytesIO(source.read(name)), allow_pickle=False) as archive:
            return {key: archive[key] for key in archive.files}
    except (ValueError, OSError, EOFError, KeyError, zipfile.BadZipFile, AttributeError, TypeError) as error:
        raise BadInput(where, "an .npz file of plain arrays", str(error)) from None


NO_VELOCITY = "joint_vel was not logged: differences of the positions"


def rollout_names(names: list[str], suffix: str) -> dict[str, str]:
    """File name -> rollout id: the stem where the stems differ, the whole path with underscores where not."""
    stems = [PurePosixPath(name).name[: -len(suffix)] for name in names]
    if len(set(stems)) == len(stems):
        return dict(zip(names, (stem.lstrip(".") or "rollout" for stem in stems), strict=True))
    return {name: name[: -len(suffix)].replace("/", "_").lstrip(".") for name in names}


def differences(time: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Velocities (T, J) where a log has none: central differences of the positions (T, J) over the stamps (T,)."""
    if len(time) < 2:
        return np.zeros_like(place)
    with np.errstate(all="ignore"):
        return np.gradient(place, time, axis=0)


def measured_rate(time: np.ndarray) -> float:
    """Rate [Hz] from the median period, to four digits; 1 where the stamps do not increase."""
    period = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    return float(f"{1 / period:.4g}") if np.isfinite(period) and 1e-5 < period < 1e5 else 1.0
