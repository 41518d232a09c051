"""A file on its way to motions: where it lies, its bytes, what is in it, or why nothing is."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.human.motion import HumanMotion, Role
from bumblebee.motion.licences.of_files import licence_of
from bumblebee.motion.licences.table import stated_of
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.texts import shown

Motion = RawMotion | HumanMotion | Clip
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class File:
    """One file, a member of an archive, or a clip of a library."""

    path: Path
    """As it is shown; a member: the archive's path joined with its name."""
    archive: Path | None = None
    """The archive that it is a member of."""
    library: Path | None = None
    """The index of the library that it is a clip of, or is itself."""
    data: bytes = field(default=b"", repr=False)
    """Its bytes until its motions are read."""
    sha256: str = ""
    csv_fps: float | None = None
    """Rate of a CSV file that does not say it [Hz]."""
    rate_from: str = ""
    """Who says that rate, where no setting does."""
    motions: tuple[Motion, ...] = ()
    refused: tuple[tuple[str, str], ...] = ()
    """Motions of a file of several that cannot be used: which, and why."""
    reason: str = ""
    """Why there are no motions."""
    skeleton: tuple[Role, ...] = ()
    """For a file that is refused for its skeleton: the joints that were found for the landmarks."""

    @property
    def licence(self) -> str:
        """That of the file: of the table beside it where it was converted here, else as `licence_of` finds it."""
        before = stated_of(self.path) if self.archive is None else None
        return before.licence if before else licence_of(self.path, self.archive)

    @property
    def source(self) -> str:
        """Folder and name; of a file that was converted here those of the file that it was made from."""
        before = stated_of(self.path) if self.archive is None else None
        return before.source if before else shown(str(Path(self.path.parent.name) / self.path.name))


def reason_of(error: BadInput, path: Path) -> str:
    """An error's line without the file's name, which stands beside it."""
    return shown(str(error).removeprefix(str(path)).lstrip(":, "), 1000)


def tried(read: Callable[[], Result], file: Path) -> Result | str:
    """Result of `read`, or why there is none."""
    try:
        return read()
    except BadInput as error:
        return reason_of(error, file)
    except OSError as error:  # a file that vanished, a disk that was unplugged
        return shown(error.strerror or str(error))
    except Exception as error:  # a mistake of ours about one file must not cost the user all the others
        return shown(f"it could not be read ({type(error).__name__}: {error}): please report this")
