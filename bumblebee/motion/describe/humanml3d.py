"""HumanML3D's texts for the motions that they describe: joined by AMASS's paths, with the frame ranges of its index.

The data set cut motions of AMASS into segments of at most 10 s, had people describe each, and mirrored them: text
NNNNNN is of the motion as recorded, MNNNNNN of the same with left and right exchanged.
"""

import csv
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text
from bumblebee.motion.describe.amass import CUT_AT_START, Key, Motions, is_smplx, key_of_index
from bumblebee.motion.describe.described import ANOTHER_RATE, BEYOND, UNREADABLE, Described, Dropped, sorted_out
from bumblebee.motion.describe.segments import Segment, index_rate, on_motion, span_of
from bumblebee.motion.describe.text_files import TextFiles, open_texts
from bumblebee.motion.licences.of_files import UNKNOWN, licence_of
from bumblebee.motion.texts import shown

LICENCE = "MIT"
"""Licence of texts, index and code, as the repository EricGuo5513/HumanML3D states; AMASS's motions have theirs."""
_COLUMNS = ["source_path", "start_frame", "end_frame", "new_name"]
_MAX_INDEX = 64 << 20  # bytes; the published index has 1 MB
_MAX_FRAME = 10_000_000  # 139 hours at 20 Hz
_NEW_NAME = re.compile(r"(\d{1,12})\.npy")


@dataclass(frozen=True)
class HumanML3D:
    """The texts by motion. `bad_rows`: one line for each row of the index that could not be used."""

    segments: Mapping[Key, tuple[Segment, ...]]
    bad_rows: tuple[str, ...]
    notes: tuple[str, ...]
    licence: str
    _texts: TextFiles
    _motions: Motions = field(repr=False)

    @classmethod
    def open(cls, folder: str | Path) -> "HumanML3D":
        """The data set in a folder with `index.csv` and `texts.zip` or `texts/`; texts are read when asked for.

        Raises:
            BadInput: no such folder, an index without its columns, or a damaged archive.
        """
        folder = Path(folder)
        segments, bad = read_index(folder / "index.csv")
        texts = open_texts(folder)
        stated = licence_of(folder / "index.csv")
        licence = LICENCE if stated == UNKNOWN else stated
        return cls(segments, bad, texts.notes, licence, texts, Motions(segments))

    def captions(
        self,
        source_path: Path,
        duration: float,
        motion_name: str = "",
        *,
        mirrored: bool = False,
        amass_fps: float | None = None,
    ) -> Described:
        """The texts of a motion, their times on it.

        Args:
            source_path: of its file; of a member, the archive's path joined with the member's name.
            duration: of the motion [s].
            motion_name: its name in a file of several.
            mirrored: the texts of the motion with left and right exchanged. Those of the motion itself are never given
                to its mirror image, nor the other way round.
            amass_fps: `mocap_framerate` of AMASS's own file, where it was read from that [Hz]; see `index_rate`.
        """
        found = self._motions.find(source_path, motion_name)
        if found.key is None:
            return Described(notes=(_note(source_path, found.note),) if found.note else ())
        cut = CUT_AT_START.get(found.key[0], 0)
        items: list[str | Dropped] = []
        for segment in self.segments[found.key]:
            items += self._of_segment(segment, cut, index_rate(amass_fps), duration, mirrored)
        captions, dropped = sorted_out(items)
        if is_smplx(source_path) and any(drop.kind == BEYOND for drop in dropped):
            return _of_another_rate(source_path, len(items))
        return Described(
            captions,
            "humanml3d" if captions else "",
            tuple(_note(source_path, drop.line) for drop in dropped),
            tuple(drop.kind for drop in dropped),
            self.licence if captions else "",
        )

    def _of_segment(
        self, segment: Segment, cut: int, rate: float, duration: float, mirrored: bool
    ) -> Iterator[str | Dropped]:
        span = span_of(segment, cut, rate, duration)
        try:
            lines = self._texts.read(f"M{segment.name}" if mirrored else segment.name)
        except BadInput as error:
            yield Dropped(UNREADABLE, str(error))
            return
        for where, line in lines:
            yield on_motion(line, where, span, duration)


def _of_another_rate(source_path: Path, count: int) -> Described:
    """AMASS states other frame rates in SMPL-X files than in SMPL-H ones, for about 5,000 files (nghorbani/amass#49).

    The index was counted on SMPL-H files. A segment beyond the motion's end shows such a file; its other segments would
    lie at wrong times.
    """
    note = (
        "its frame rate cannot be that of HumanML3D's index (segments lie beyond its end), as in many SMPL-X files of "
    )
    note += "AMASS: none of its texts is used. The same motion's SMPL-H file has the right rate."
    return Described(notes=(_note(source_path, note),), dropped=(ANOTHER_RATE,) * count)


def _note(source_path: Path, line: str) -> str:
    """One line about a motion; names of members are not ours."""
    return shown(f"{source_path}: {line}", 1000)


def read_index(path: Path) -> tuple[dict[Key, tuple[Segment, ...]], tuple[str, ...]]:
    """The segments by motion, and a line for each row that cannot be used.

    Raises:
        BadInput: no such file, too large, or without the four columns.
    """
    lines = read_text(path, _MAX_INDEX).splitlines()
    columns = [name.strip() for name in lines[0].split(",")] if lines else []
    if missing := [name for name in _COLUMNS if name not in columns]:
        raise BadInput(path, f"the columns {', '.join(_COLUMNS)}", f"no {missing[0]}")
    segments: dict[Key, list[Segment]] = defaultdict(list)
    spelled: dict[Key, str] = {}
    names: set[str] = set()
    bad: list[str] = []
    for number, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        try:
            source_path, key, segment = _row(f"{path}, line {number}", columns, line)
            if segment.name in names:
                raise BadInput(f"{path}, line {number}", "a new_name of its own", f"{segment.name} again")
            if spelled.setdefault(key, source_path) != source_path:
                raise BadInput(
                    f"{path}, line {number}", "one path for a motion", f"{source_path} beside {spelled[key]}"
                )
        except BadInput as error:
            bad.append(shown(str(error)))
            continue
        names.add(segment.name)
        segments[key].append(segment)
    return {key: tuple(found) for key, found in segments.items()}, tuple(bad)


def _row(where: str, columns: list[str], line: str) -> tuple[str, Key, Segment]:
    try:
        cells = next(csv.reader([line], strict=True))
    except csv.Error as error:
        raise BadInput(where, "a row of a CSV file", str(error)) from None
    if len(cells) != len(columns):
        raise BadInput(where, f"{len(columns)} cells", f"{len(cells)}")
    row = dict(zip(columns, cells, strict=True))
    key, name = key_of_index(row["source_path"]), _NEW_NAME.fullmatch(row["new_name"].strip())
    if key is None:
        raise BadInput(where, "a path <data set>/<subject>/<name> of AMASS", repr(row["source_path"])[:80])
    if name is None:
        raise BadInput(where, "a new_name of the form NNNNNN.npy", repr(row["new_name"])[:80])
    try:
        start, end = int(row["start_frame"]), int(row["end_frame"])
    except ValueError:
        raise BadInput(where, "whole frames", f"{row['start_frame']!r} to {row['end_frame']!r}"[:80]) from None
    if not (0 <= start < _MAX_FRAME and (end == -1 or start < end < _MAX_FRAME)):
        raise BadInput(where, f"frames from 0 to {_MAX_FRAME:,}, the first before the last, or -1", f"{start} to {end}")
    return row["source_path"], key, Segment(name[1], start, None if end == -1 else end)
