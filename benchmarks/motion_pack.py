"""Motions as one file of plain arrays, for a machine that has no copy of the source folders.

    python -m benchmarks.motion_pack FOLDER... --out motions.npz

Each folder becomes a group of that name; motions are read, grounded, cut to 10 s and filtered as the pipeline does, one
in ten is held out by its name. Pieces that the filter drops stay in the file, marked, so that whole motions can be told
from those with a gap. The file holds no objects: it is read without unpickling anything.
"""

import argparse
import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import make_library
from bumblebee.motion.filters.rules import filter_clips
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.pieces import hold_out, motion_of
from bumblebee.motion.reading.folder import read_folder

EMBEDDED, EMBEDDED_SHARE = "embedded", 0.15  # the demo's own split
FPS = 50.0


@dataclass(frozen=True)
class Packed:
    """One piece of a motion: the group it belongs to, whether the filter keeps it, and the clip."""

    group: str
    kept: bool
    clip: Clip


def pack(folders: Sequence[Path], share: float = 0.10) -> list[Packed]:
    """Pieces of all motions in `folders`, and of the embedded library, with `share` of the motions held out."""
    rows: list[Packed] = []
    for folder in folders:
        rows += _marked(folder.name, hold_out(read_folder(folder).clips, share))
    return rows + _marked(EMBEDDED, hold_out(make_library(), EMBEDDED_SHARE))


def _marked(group: str, clips: Sequence[Clip]) -> list[Packed]:
    kept = {clip.name for clip in filter_clips(clips)[0]}
    return [Packed(group, clip.name in kept, clip) for clip in clips]


def write_pack(path: Path, rows: Sequence[Packed]) -> None:
    """Write the pieces as arrays of numbers and strings."""
    clips = [row.clip for row in rows]
    np.savez_compressed(
        path,
        group=[row.group for row in rows],
        kept=[row.kept for row in rows],
        frames=[clip.frames for clip in clips],
        **{field: [getattr(clip, field) for clip in clips] for field in ("name", "family", "split")},
        **{
            field: np.concatenate([getattr(c, field) for c in clips])
            for field in ("root_pos", "root_quat", "joint_pos")
        },
    )


def read_pack(path: Path) -> list[Packed]:
    """The pieces in a file of `write_pack`.

    Raises:
        BadInput: if there is no such file or it holds something else.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            table = {key: file[key] for key in file.files}
        ends = np.cumsum(table["frames"])
        rows = []
        for i, end in enumerate(ends):
            frames = slice(end - table["frames"][i], end)
            arrays = [table[field][frames] for field in ("root_pos", "root_quat", "joint_pos")]
            clip = make_clip(str(table["name"][i]), FPS, *arrays, family=str(table["family"][i]))
            rows.append(
                Packed(str(table["group"][i]), bool(table["kept"][i]), replace(clip, split=str(table["split"][i])))
            )
    except FileNotFoundError:
        raise BadInput(path, "a file of benchmarks.motion_pack", "no such file") from None
    except (ValueError, KeyError, OSError) as error:
        raise BadInput(path, "a file of benchmarks.motion_pack", f"{type(error).__name__}: {error}") from None
    return rows


def whole_motions(rows: Sequence[Packed]) -> list[Packed]:
    """Motions put together again from their pieces; those of which the filter dropped a piece are left out."""
    groups: dict[tuple[str, str], list[Packed]] = defaultdict(list)
    for row in rows:
        groups[row.group, motion_of(row.clip.name)].append(row)
    whole = []
    for (group, name), parts in groups.items():
        if not all(part.kept for part in parts):
            continue
        clips = sorted((part.clip for part in parts), key=_number)
        arrays = {
            field: np.concatenate([getattr(clip, field) for clip in clips])
            for field in ("root_pos", "root_quat", "joint_pos", "key_pos")
        }
        whole.append(Packed(group, True, replace(clips[0], name=name, captions=(), **arrays)))
    return whole


def _number(clip: Clip) -> int:
    found = re.search(r"_p(\d+)$", clip.name)
    return int(found.group(1)) if found else 0


def main() -> None:
    """Pack the folders named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--share", type=float, default=0.10, help="share of the motions that is held out")
    options = parser.parse_args()
    rows = pack(options.folders, options.share)
    write_pack(options.out, rows)
    for group in dict.fromkeys(row.group for row in rows):
        own = [row for row in rows if row.group == group and row.kept]
        held = sum(row.clip.split == "test" for row in own)
        dropped = sum(row.group == group for row in rows) - len(own)
        print(f"{group}: {len(own)} pieces, {held} of them held out, {dropped} dropped by the filter")


if __name__ == "__main__":
    main()
