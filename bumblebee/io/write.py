"""The one way out: an output appears whole or not at all, replaces only what this library made, and no input."""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from bumblebee.errors import BadInput

TRIED_BYTES = 1 << 20  # written and removed again to see whether a disk takes a result


def refuse_overlap(out: Path, inputs: Sequence[Path]) -> None:
    """`BadInput` where `out` is an input, or a folder that holds one; links are followed."""
    target = Path(os.path.realpath(out))
    for given in inputs:
        source = Path(os.path.realpath(given))
        if target == source or target in source.parents or _same(out, given):
            raise BadInput(out, "a place apart from what is read", f"one that is or holds {given}", "Choose another.")


def refuse_foreign(out: Path, is_ours: Callable[[Path], bool], what: str) -> None:
    """`BadInput` where something lies at `out` that `is_ours` does not know; `what` names what would be replaced."""
    if os.path.lexists(out) and not (not out.is_symlink() and is_ours(out)):
        raise BadInput(out, f"a new name, or {what} to replace", "something else", "Choose another name.")


def try_output(out: Path) -> None:
    """See whether the disk takes an output at `out`, before minutes of work; nothing is left behind.

    Raises:
        BadInput: no permission, a read-only or full disk, a file where a folder must be.
    """
    parent = Path(os.path.abspath(out)).parent
    made: list[Path] = []
    try:
        for folder in reversed([parent, *parent.parents]):
            if not folder.exists():
                folder.mkdir()
                made.append(folder)
        with tempfile.NamedTemporaryFile(dir=parent, prefix=f".{out.name[:40]}.") as probe:
            probe.write(bytes(TRIED_BYTES))
            probe.flush()
            os.fsync(probe.fileno())
    except OSError as error:
        raise unwritable(out, error) from None
    finally:
        for folder in reversed(made):
            folder.rmdir()


def unwritable(out: Path, error: OSError) -> BadInput:
    """The line for an output that the system refuses."""
    return BadInput(out, "a place that can be written", error.strerror or str(error), "Choose another place.")


def write_file(path: Path, content: bytes | str) -> None:
    """Write a file, whole or not at all; one that is there is replaced: ask `refuse_foreign` first."""
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name[:40]}.", suffix=".part")
    except OSError as error:
        raise unwritable(path, error) from None
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except OSError as error:
        raise unwritable(path, error) from None
    finally:
        Path(name).unlink(missing_ok=True)


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """A folder to fill; it takes the place of `out` at the end, whole, or never.

    Where the last step fails (a disk that was unplugged, a name that was taken meanwhile), the finished folder stays
    beside `out` or in the temporary folder, and the `BadInput` says where.
    """
    out = Path(os.path.abspath(out))
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(dir=out.parent, prefix=f".{out.name[:40]}."))
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
        do = f"The result is complete and kept in {fresh}."
        raise BadInput(out, "a place that can be written", error.strerror or str(error), do) from None
    finally:
        if not finished:
            shutil.rmtree(fresh, ignore_errors=True)


def swap(fresh: Path, out: Path) -> None:
    """Put `fresh` where `out` is, by renames; what was there is removed only when the new one is in place."""
    old = out.with_name(f".{out.name[:40]}.{os.getpid()}.old")
    replaced = os.path.lexists(out)
    if replaced:
        os.rename(out, old)
    try:
        if os.stat(fresh).st_dev == os.stat(out.parent).st_dev:
            os.rename(fresh, out)
        else:
            shutil.move(fresh, out)
    except OSError:
        if replaced:
            os.rename(old, out)
        raise
    if replaced:
        shutil.rmtree(old, ignore_errors=True)


def _same(one: Path, other: Path) -> bool:
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False
