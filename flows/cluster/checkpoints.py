"""Checkpoints of a stage on the cluster's shared remote: a machine that repeats a stage goes on where a lost one was.

They lie in `checkpoints/KEY/` beside DVC's own folders. KEY is the stage's key of DVC's run cache, a hash of its code,
parameters and inputs, so that no other inputs find them. A file is named by its hash: one that is torn is not used.
"""

import contextlib
import hashlib
import io
import sys
import tarfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flows.cluster.parcel import REMOTE
from tasks.running.paths import SCRATCH

FOLDER = "checkpoints"
WRITTEN = ("checkpoint.pt", "distill.pt")  # whose change says that there is a new one: tests compare with the trainers
LOOK_EVERY = 1.0  # [s]
TRIES = 5  # to pack the folder while nothing in it changes


@dataclass(frozen=True)
class Shelf:
    """The place for one stage's checkpoints, of which the newest is kept."""

    fs: Any
    """File system of DVC's remote."""
    folder: str
    """In it."""

    def put(self, packed: bytes) -> None:
        """Add a checkpoint, then remove those of before."""
        old = self._names()
        number = max((_number(name) for name in old), default=0) + 1
        self.fs.makedirs(self.folder, exist_ok=True)
        name = f"{number:09d}-{hashlib.sha256(packed).hexdigest()}.tar"
        self.fs.pipe_file(self.fs.join(self.folder, name), packed)
        for each in old:
            with contextlib.suppress(FileNotFoundError):  # another machine, taken for lost, removed it
                self.fs.rm_file(self.fs.join(self.folder, each))

    def newest(self) -> bytes | None:
        """The last checkpoint that is whole."""
        for name in sorted(self._names(), reverse=True):
            with contextlib.suppress(FileNotFoundError):  # another machine put a newer one
                packed = bytes(self.fs.cat_file(self.fs.join(self.folder, name)))
                if hashlib.sha256(packed).hexdigest() == name[10:-4]:
                    return packed
        return None

    def clear(self) -> None:
        """Remove all of them."""
        if self.fs.exists(self.folder):
            self.fs.rm(self.folder, recursive=True)

    def _names(self) -> list[str]:
        if not self.fs.exists(self.folder):
            return []
        return [name for path in self.fs.find(self.folder) if _number(name := self.fs.name(path))]


def _number(name: str) -> int:
    return int(name[:9]) if name[:9].isdigit() and name[9:10] == "-" and name.endswith(".tar") else 0


def shelf_of(repo: Any, stage: Any) -> Shelf:
    """The place for a stage of DVC's whose dependencies are saved (`stage.save_deps()`)."""
    from dvc.stage.cache import _get_stage_hash

    remote = repo.cloud.get_remote(REMOTE, "push")
    return Shelf(remote.fs, remote.fs.join(remote.path, FOLDER, _get_stage_hash(stage)))


def pack(scratch: Path) -> bytes | None:
    """The folder with checkpoints as a tar file; None where it changed again and again meanwhile, or has none."""
    for _ in range(TRIES):
        before, stream = _state(scratch), io.BytesIO()
        if not _written(before):
            return None
        with contextlib.suppress(FileNotFoundError):
            with tarfile.open(fileobj=stream, mode="w") as packed:
                for name in sorted(before):
                    packed.add(scratch / name, name)
            if _state(scratch) == before:
                return stream.getvalue()
    return None


def unpack(packed: bytes, scratch: Path) -> None:
    """Lay out what `pack` packed."""
    with tarfile.open(fileobj=io.BytesIO(packed)) as found:
        found.extractall(scratch, filter="data")


def _state(scratch: Path) -> dict[str, tuple[int, int]]:
    """Path -> time of change and size of every file."""
    found = {}
    for file in scratch.rglob("*"):
        with contextlib.suppress(FileNotFoundError):
            if file.is_file():
                found[str(file.relative_to(scratch))] = (file.stat().st_mtime_ns, file.stat().st_size)
    return found


def _written(state: dict[str, tuple[int, int]]) -> dict[str, tuple[int, int]]:
    return {name: what for name, what in state.items() if name.rpartition("/")[2] in WRITTEN}


@contextlib.contextmanager
def kept(shelf: Shelf, every: float, scratch: Path = SCRATCH) -> Iterator[None]:
    """Take over the last checkpoint, and while the block runs put each new one onto the shelf.

    A store that does not answer ends nothing: it is said, and tried again.

    Args:
        shelf: of the stage that runs in the block.
        every: least time between two checkpoints [s].
        scratch: the folder in which the stage keeps them.
    """
    if (packed := shelf.newest()) is not None:
        unpack(packed, scratch)
    done = threading.Event()
    last = _written(_state(scratch))

    def watch() -> None:
        nonlocal last
        while not done.wait(LOOK_EVERY):
            now = _written(_state(scratch))
            if now == last:
                continue
            try:
                if (fresh := pack(scratch)) is None:
                    continue
                shelf.put(fresh)
                last = now
            except Exception as error:  # a store has errors of its own
                print(f"checkpoint not kept: {type(error).__name__}: {error}"[:300], file=sys.stderr, flush=True)
            done.wait(every)

    thread = threading.Thread(target=watch, daemon=True, name="checkpoints")
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
