"""The captions of each motion, from whatever text there is: one entry point for whoever reads motions."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text
from bumblebee.motion.captions import caption_from_name
from bumblebee.motion.describe.described import TWICE, UNREADABLE, Described, Dropped, fitted, sorted_out
from bumblebee.motion.describe.humanml3d import HumanML3D
from bumblebee.motion.describe.table import CaptionTable
from bumblebee.motion.texts import shown
from bumblebee.ranges import Line, Ranged

_MAX_BYTES = 1 << 20  # of a caption file; HumanML3D's have a few hundred


@dataclass(frozen=True)
class DescribeConfig(Ranged):
    """Where texts about the motions come from; the first that has one for a motion is taken, in this order."""

    captions_folder: Line = ""
    """Where `<stem>.txt` caption files in HumanML3D's line format lie, if not beside the motions; a path below it as of
    the motion below its folder goes before the bare name."""
    captions_csv: Line = ""
    """A CSV file with the columns motion,caption or motion,caption,from,to [s]."""
    humanml3d: Line = ""
    """A folder with HumanML3D's index.csv and texts.zip, for motions of AMASS and CMU."""
    name_words: bool = False
    """Whether a motion without text gets its file's name for one; such words count as no text in any evidence."""


def describer(config: DescribeConfig, root: Path) -> "Describer":
    """Describer of the motions of the folder or file `root`.

    Raises:
        BadInput: a table or a data set that cannot be opened.
    """
    table = CaptionTable.read(config.captions_csv) if config.captions_csv else None
    humanml3d = HumanML3D.open(config.humanml3d) if config.humanml3d else None
    return Describer(config, root if root.is_dir() else root.parent, table, humanml3d)


def beside(motion: Path, duration: float) -> Described:
    """The captions in the text file beside a motion of `duration` [s], where nothing else is asked."""
    return Describer(DescribeConfig(), motion.parent, None, None).captions(motion, motion.stem, duration)


@dataclass(frozen=True)
class Describer:
    """Answers for one motion after the other, and keeps no count itself: `accounting.account` adds the answers up."""

    config: DescribeConfig
    root: Path
    table: CaptionTable | None
    humanml3d: HumanML3D | None

    def captions(
        self, source_path: Path, motion_name: str, duration: float, amass_fps: float | None = None
    ) -> Described:
        """The captions of a motion.

        Args:
            source_path: of its file; of a member, the archive's path joined with the member's name.
            motion_name: its name in the file.
            duration: of the motion, before it is cut into pieces [s].
            amass_fps: `mocap_framerate` of AMASS's own file, where the motion was read from that [Hz].
        """
        sources: list[Callable[[], Described]] = [
            lambda: self._beside(source_path, duration),
            lambda: self._from_table(source_path, motion_name, duration),
            lambda: self._from_humanml3d(source_path, motion_name, duration, amass_fps),
            lambda: self._from_name(motion_name),
        ]
        told = Described()
        for source in sources:
            told = _together(told, source())
            if told.captions:
                break
        if self.table is not None and told.source == "file":
            rows = self.table.of(self._below(source_path), motion_name)
            told = replace(told, passed_rows=frozenset(row.number for row in rows))
        return told

    def _below(self, path: Path) -> Path:
        return path.relative_to(self.root) if path.is_relative_to(self.root) else path

    def _beside(self, path: Path, duration: float) -> Described:
        file = caption_file(path, self.config.captions_folder, self._below(path))
        if file is None:
            return Described()
        try:
            lines = [(number, line.strip()) for number, line in enumerate(read_text(file, _MAX_BYTES).splitlines(), 1)]
        except BadInput as error:
            return _sorted_out([Dropped(UNREADABLE, str(error))], "file")
        return _sorted_out([fitted(line, f"{file}, line {number}", duration) for number, line in lines if line], "file")

    def _from_table(self, path: Path, motion_name: str, duration: float) -> Described:
        if self.table is None:
            return Described()
        rows = self.table.of(self._below(path), motion_name)
        found: list[str | Dropped] = []
        for row in rows:
            item = fitted(row.line, f"{self.table.path}, line {row.number}, {row.motion}", duration)
            if item in found:  # once by the file's name, once by its path
                item = Dropped(TWICE, f"{self.table.path}, line {row.number}: said of {row.motion} before")
            found.append(item)
        used = frozenset(row.number for row, item in zip(rows, found, strict=True) if isinstance(item, str))
        dropped = frozenset(row.number for row in rows) - used
        return replace(_sorted_out(found, "csv"), used_rows=used, dropped_rows=dropped)

    def _from_humanml3d(self, path: Path, motion_name: str, duration: float, amass_fps: float | None) -> Described:
        if self.humanml3d is None:
            return Described()
        return self.humanml3d.captions(path, duration, motion_name, amass_fps=amass_fps)

    def _from_name(self, motion_name: str) -> Described:
        return Described((caption_from_name(motion_name),), "name") if self.config.name_words else Described()


def caption_file(motion: Path, folder: str | Path, below: Path) -> Path | None:
    """The text file of a motion: in `folder` by its path below the motions' folder or its name, or beside it."""
    inside = not below.is_absolute() and ".." not in below.parts  # names in archives are not ours
    places = [*([Path(folder) / below.parent] if inside else []), Path(folder)] if str(folder) else []
    paths = (place / f"{motion.stem}.txt" for place in [*places, motion.parent])
    return next((path for path in paths if os.path.lexists(path)), None)


def _sorted_out(found: list[str | Dropped], source: str) -> Described:
    captions, dropped = sorted_out(found)
    notes = tuple(shown(drop.line, 1000) for drop in dropped)
    return Described(captions, source if captions else "", notes, tuple(drop.kind for drop in dropped))


def _together(told: Described, more: Described) -> Described:
    """Texts of a further source, with the notes of those before, which gave no caption."""
    return replace(
        more,
        notes=told.notes + more.notes,
        dropped=told.dropped + more.dropped,
        used_rows=told.used_rows | more.used_rows,
        dropped_rows=told.dropped_rows | more.dropped_rows,
    )
