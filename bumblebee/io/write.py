"""The one way out: an output appears whole or not at all, replaces only what this library made, and no input."""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io import left_overs

TRIED_BYTES = 1 << 20  # written and removed again to see whether a disk takes a result
_OTHER = "Name another output folder or file."


def refuse_overlap(out: Path, inputs: Sequence[Path]) -> None:
    """`BadInput` where `out` is an input, or a folder that holds one; links are followed."""
    target = Path(os.path.realpath(out))
    for given in inputs:
        source = Path(os.path.realpath(given))
        if target == source or target in source.parents or _same(out, given):
            raise BadInput(out, f"an output that does not contain the input {given}", "one that does", _OTHER)


def refuse_entering(out: Path, inputs: Sequence[Path]) -> None:
    """`BadInput` where `out` overlaps an input, or lies in a folder that is one; links are followed."""
    refuse_overlap(out, inputs)
    above = Path(os.path.realpath(out)).parents
    for given in inputs:
        if Path(os.path.realpath(given)) in above:
            raise BadInput(out, f"an output outside the input {given}", "one inside", _OTHER)


def refuse_foreign(out: Path, is_ours: Callable[[Path], bool], what: str) -> None:
    """`BadInput` where something lies at `out` that `is_ours` does not know; `what` names what would be replaced."""
    if os.path.lexists(out) and not (not out.is_symlink() and is_ours(out)):
        raise BadInput(out, f"a new name, or {what} to replace", "something else", "Choose another name.")


def refuse_existing(out: Path) -> None:
    """`BadInput` where anything lies at `out`: for what replaces nothing, not even its own earlier result."""
    if os.path.lexists(out):
        raise BadInput(out, "a new name", "one that exists", "Nothing is replaced: choose another, or remove it first.")


def try_output(out: Path) -> None:
    """See whether the disk takes an output at `out`, before minutes of work; nothing is left behind.

    What runs that were killed left beside `out` is cleared; a result that one had put aside comes back.

    Raises:
        BadInput: no permission, a read-only or full disk, a file where a folder must be.
    """
    out = Path(os.path.abspath(out))
    made: list[Path] = []
    try:
        for folder in reversed([out.parent, *out.parent.parents]):
            if not folder.exists():
                folder.mkdir()
                made.append(folder)
        left_overs.clear(out)
        with tempfile.NamedTemporaryFile(dir=out.parent, prefix=left_overs.prefix(out), suffix=".part") as probe:
            probe.write(bytes(TRIED_BYTES))
            probe.flush()
            os.fsync(probe.fileno())
    except OSError as error:
        raise unwritable(out, error) from None
    finally:
        for folder in reversed(made):
            folder.rmdir()


def unwritable(out: Path, error: OSError, do: str = "Choose another place.") -> BadInput:
    """The line for an output that the system refuses."""
    return BadInput(out, "a place that can be written", error.strerror or str(error), do)


def write_file(path: Path, content: bytes | str) -> None:
    """Write a file, whole or not at all; one that is there is replaced: ask `refuse_foreign` first."""
    path = Path(os.path.abspath(path))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=left_overs.prefix(path), suffix=".part")
    except OSError as error:
        raise unwritable(path, error) from None
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(_bytes(content))
        os.chmod(name, 0o644)
        os.replace(name, path)
    except OSError as error:
        raise unwritable(path, error) from None
    finally:
        Path(name).unlink(missing_ok=True)


def write_folder(out: Path, files: Mapping[str, bytes | str]) -> None:
    """Write a folder of files, whole or not at all; where its place takes nothing it is kept elsewhere.

    Args:
        out: the folder; one that is there is replaced.
        files: name -> content.
    """
    try:
        with new_folder(out) as folder:
            _fill(folder, files)
    except OSError as error:
        raise unwritable(out, error, kept(out.name, files)) from None


def kept(name: str, files: Mapping[str, bytes | str]) -> str:
    """Keep a finished result in the temporary folder; the sentence that says where, or that it could not be."""
    place = None
    try:
        place = Path(tempfile.mkdtemp(prefix=f"{name[:40].lstrip('.')}."))
        _fill(place, files)
    except OSError as error:
        if place is not None:
            shutil.rmtree(place, ignore_errors=True)
        return f"The result is lost: the temporary folder takes nothing either ({error.strerror})."
    return f"The result is complete and kept in {place}."


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """A folder to fill; it takes the place of `out` at the end, whole, or never.

    Where the last step fails (a disk that was unplugged, a name that was taken meanwhile), the finished folder stays
    beside `out` or in the temporary folder, and the `BadInput` says where.
    """
    out = Path(os.path.abspath(out))
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        left_overs.clear(out)
        fresh = Path(tempfile.mkdtemp(dir=out.parent, prefix=left_overs.prefix(out), suffix=".part"))
    except OSError:
        fresh = Path(tempfile.mkdtemp(prefix=f"{out.name[:40]}."))
    finished = False
    try:
        fresh.chmod(0o755)
        yield fresh
        finished = True
        swap(fresh, out)
    except OSError as error:
        if not finished:
            raise
        raise unwritable(out, error, f"The result is complete and kept in {left_overs.spare(fresh)}.") from None
    except BaseException:  # stopped while it was put in its place
        finished = False
        raise
    finally:
        if not finished:
            shutil.rmtree(fresh, ignore_errors=True)


def swap(fresh: Path, out: Path) -> None:
    """Put `fresh` where `out` is, by renames; what was there is removed only when the new one is in place."""
    near = fresh if os.stat(fresh).st_dev == os.stat(out.parent).st_dev else _copied(fresh, out)
    old = out.with_name(f"{left_overs.prefix(out)}old")
    replaced = os.path.lexists(out)
    try:
        if replaced:
            shutil.rmtree(old, ignore_errors=True)
            os.rename(out, old)
        os.rename(near, out)
    except BaseException:
        if replaced and not os.path.lexists(out):
            os.rename(old, out)
        if near != fresh:
            shutil.rmtree(near, ignore_errors=True)
        raise
    for folder in (old, *([fresh] if near != fresh else [])):
        shutil.rmtree(folder, ignore_errors=True)


def _copied(fresh: Path, out: Path) -> Path:
    """Copy of the folder on the disk of `out`, from which a rename is enough."""
    near = Path(tempfile.mkdtemp(dir=out.parent, prefix=left_overs.prefix(out), suffix=".part"))
    try:
        shutil.copytree(fresh, near, dirs_exist_ok=True)
    except BaseException:
        shutil.rmtree(near, ignore_errors=True)
        raise
    return near


def _fill(folder: Path, files: Mapping[str, bytes | str]) -> None:
    for name, content in files.items():
        (folder / name).write_bytes(_bytes(content))


def _bytes(content: bytes | str) -> bytes:
    return content.encode() if isinstance(content, str) else content


def _same(one: Path, other: Path) -> bool:
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False
