"""Long motions cut into pieces, and the split into training and held-out motions."""

import hashlib
import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

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


def origin(clip: Clip) -> str:
    """The name of the motion in its own folder: without the folder's, which tells apart equal names of several."""
    folder = safe_stem(Path(clip.source).parent.name, "")[:20]
    name = motion_of(clip.name)
    return re.sub(r"_\d+$", "", name.removeprefix(f"{folder}_")) if folder and name.startswith(f"{folder}_") else name


def hold_out(clips: Iterable[Clip], share: float) -> list[Clip]:
    """The clips with `split` set: `share` of the motions of each family are "test", by a hash of their names.

    All pieces of one motion go to the same side, and so does one motion that lies there in several forms, such as a
    person's and somebody's retarget of it, under one name in two folders. A family of at least four motions has at least one held out and one
    left; a smaller one has none held out, and none has where `share` is 0.
    """
    clips = list(clips)
    families: dict[str, set[str]] = defaultdict(set)
    for clip in clips:
        families[clip.family].add(origin(clip))
    held: set[str] = set()
    for motions in families.values():
        if share > 0 and len(motions) >= FAMILY_MINIMUM:
            count = min(max(1, round(share * len(motions))), len(motions) - 1)
            held |= set(sorted(motions, key=_position)[:count])
    return [replace(clip, split="test" if origin(clip) in held else "train") for clip in clips]


def _position(name: str) -> float:
    """A number from 0 to 1 that depends on the name alone."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") / 2**64
