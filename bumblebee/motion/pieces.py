"""Long motions cut into pieces, and the split into training and held-out motions."""

import hashlib
import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Protocol

import numpy as np

from bumblebee.io.names import safe_stem
from bumblebee.motion.clip import Clip
from bumblebee.motion.describe.windows import within

FAMILY_MINIMUM = 4  # motions: a family of so many has at least one held out


def split_long(clip: Clip, max_seconds: float) -> list[Clip]:
    """The clip itself, or equal pieces `<name>_p0`, `_p1` ... none longer than `max_seconds` (0: never cut)."""
    if max_seconds <= 0 or clip.duration <= max_seconds:
        return [clip]
    count = int(np.ceil(clip.frames / (max_seconds * clip.fps + 1)))
    edges = np.linspace(0, clip.frames, count + 1).round().astype(int)
    pieces = []
    for number, (start, end) in enumerate(pairwise(edges)):
        arrays = {name: getattr(clip, name)[start:end] for name in ("root_pos", "root_quat", "joint_pos", "key_pos")}
        captions = within(clip.captions, start / clip.fps, (end - 1) / clip.fps)
        source = clip.caption_source if captions else ""
        pieces.append(replace(clip, name=f"{clip.name}_p{number}", captions=captions, caption_source=source, **arrays))
    return pieces


def motion_of(name: str) -> str:
    """The motion that a piece was cut from; a whole clip's own name."""
    return re.sub(r"_p\d+$", "", name)


def origin(name: str, source: str) -> str:
    """Name of a motion in its own file, which several forms of it in several folders have in common.

    Args:
        name: of the clip, where equal names of several files are told apart by the folder's, and then by a number.
        source: of the clip, `<folder>/<file>`.
    """
    place, motion = Path(source), motion_of(name)
    folder, stem = safe_stem(place.parent.name, "")[:20], motion_of(safe_stem(place.stem, ""))
    if folder and stem and re.fullmatch(rf"{re.escape(f'{folder}_{stem}')}(_\d+)?", motion):
        return stem
    # One of several in its file: a number at its end may be its own.
    return motion.removeprefix(f"{folder}_") if folder and motion != stem else motion


class Named(Protocol):
    """A clip, or a row of the library's index."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def source(self) -> str: ...  # noqa: D102
    @property
    def family(self) -> str: ...  # noqa: D102


def held_out(motions: Iterable[Named], share: float) -> set[str]:
    """The names of the clips to hold out: `share` of the motions of each family, by a hash of their names.

    All pieces of one motion go to the same side, and so does one motion that lies there in several forms, such as a
    person's and somebody's retarget of it, under one name in two folders. A family of at least four motions has at
    least one held out and one left; a smaller one has none held out, and none has where `share` is 0.
    """
    motions, held = list(motions), set[str]()
    for members in _families(motions).values():
        if share > 0 and len(members) >= FAMILY_MINIMUM:
            count = min(max(1, round(share * len(members))), len(members) - 1)
            held |= set(sorted(members, key=_position)[:count])
    return {one.name for one in motions if origin(one.name, one.source) in held}


def too_few(motions: Iterable[Named]) -> str:
    """How many motions it takes to hold one out, where no family has as many."""
    family, members = max(_families(motions).items(), key=lambda pair: len(pair[1]))
    kind = repr(family) if family else "the one of names that say none"
    return f"it takes {FAMILY_MINIMUM} motions of one kind, by their names; the largest, {kind}, has {len(members)}"


def _families(motions: Iterable[Named]) -> dict[str, set[str]]:
    """Family -> its motions, each once whatever its pieces and forms."""
    families: dict[str, set[str]] = defaultdict(set)
    for one in motions:
        families[one.family].add(origin(one.name, one.source))
    return families


def hold_out(clips: Iterable[Clip], share: float) -> list[Clip]:
    """The clips with `split` set, "test" for those of `held_out` and "train" for the others."""
    clips = list(clips)
    held = held_out(clips, share)
    return [replace(clip, split="test" if clip.name in held else "train") for clip in clips]


def _position(name: str) -> float:
    """A number from 0 to 1 that depends on the name alone."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") / 2**64
