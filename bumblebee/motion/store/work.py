"""Work on every clip of a library, on all cores: the filter, statistics, features."""

from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from pathlib import Path
from typing import TypeVar

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.side_by_side import in_order
from bumblebee.motion.store.library import Library

Result = TypeVar("Result")
BATCH = 64  # clips that a process takes at a time


def map_clips(folder: Path, work: Callable[[Clip], Result], processes: int = 0) -> Iterator[Result]:
    """`work(clip)` for each clip, in the index's order.

    Args:
        folder: the library.
        work: a function of a module, or a `partial` of one: it goes to other processes.
        processes: how many; 0: as many as there are cores, and none for few clips.

    Raises:
        BadInput: a damaged clip; whatever `work` raises.
    """
    library = Library(folder)
    starts = range(0, len(library), BATCH)
    if len(starts) <= 2:
        yield from map(work, library)
        return
    for done in in_order(partial(_batch, Path(folder), work), starts, processes):
        yield from done


def _batch(folder: Path, work: Callable[[Clip], Result], start: int) -> list[Result]:
    library = _opened(folder)
    done = []
    for _, clip in library.each(range(start, min(start + BATCH, len(library)))):
        if isinstance(clip, BadInput):
            raise clip
        done.append(work(clip))
    return done


@lru_cache(maxsize=1)
def _opened(folder: Path) -> Library:
    """The library, opened once in each process."""
    return Library(folder)
