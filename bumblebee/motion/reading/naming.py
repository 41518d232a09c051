"""Names of clips that are read together, and of files: distinct, and short enough."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from bumblebee.io.names import LONGEST, safe_stem
from bumblebee.motion.clip import Clip
from bumblebee.motion.licences.table import LICENCES
from bumblebee.motion.pieces import motion_of


def distinct(found: Iterable[tuple[Path, list[Clip]]]) -> Iterator[Clip]:
    """The clips of all groups in order, under names that are distinct.

    Names that occur in several groups get the folder's name in front, and a number if that is not enough. Names that
    differ in case only count as equal: some file systems do not tell them apart.
    """
    taken: set[str] = set()
    for file, group in found:
        names = [_fitting(motion_of(clip.name), _tail(clip.name)) for clip in group]
        if taken & _folded(names):
            folder = safe_stem(file.parent.name, "folder")[:20]
            names = [_fitting(f"{folder}_{motion_of(name)}", _tail(name)) for name in names]
        first, number = names, 2
        while taken & _folded(names):
            names = [_fitting(motion_of(name), f"_{number}{_tail(name)}") for name in first]  # walk_p3 -> walk_2_p3
            number += 1
        taken |= _folded(names)
        yield from (replace(clip, name=name) for clip, name in zip(group, names, strict=True))


def _folded(names: list[str]) -> set[str]:
    return {name.casefold() for name in names}


def _tail(name: str) -> str:
    """The number of a piece, `_p3`, or nothing."""
    return name[len(motion_of(name)) :]


def _fitting(motion: str, tail: str) -> str:
    """`motion` with `tail`, cut in between to what a name may have."""
    while len((motion + tail).encode()) > LONGEST:
        motion = motion[:-1]
    return motion + tail


class Names:
    """Names of files, no two alike, also where the file system does not tell cases apart."""

    def __init__(self) -> None:
        self._taken = {_same(Path(LICENCES).stem)}
        self._last: dict[str, int] = {}  # so that a hundred thousand motions of one name need no search each

    def distinct(self, name: str, folder: str) -> str:
        """`name`, with the folder's in front where it is taken, with a number where that is not enough."""
        tried = name
        if _same(tried) in self._taken and folder:
            tried = safe_stem(f"{folder[:20]}_{name}")
        stem, number = tried[:100], self._last.get(_same(tried[:100]), 1)
        while _same(tried) in self._taken:
            number += 1
            tried = f"{stem}_{number}"
        self._last[_same(stem)] = number
        self._taken.add(_same(tried))
        return tried


def _same(name: str) -> str:
    return name.replace(".", "_").casefold()
