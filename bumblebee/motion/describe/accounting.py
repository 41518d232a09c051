"""Motions and captions by where the texts came from, in counts that add up."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from bumblebee.motion.describe.described import Described
from bumblebee.motion.describe.describer import Describer
from bumblebee.motion.describe.table import Row


@dataclass(frozen=True)
class Account:
    """Account of what a describer gave to all motions of a run."""

    motions: dict[str, int]
    """Motions by source of their captions, "none" for those without; together all of them."""
    captions: dict[str, int]
    """Captions that are used, by source."""
    dropped: dict[str, int]
    """Captions that are not, by reason; with those that are used all that were read for a motion."""
    rows: dict[str, int]
    """Rows of the user's CSV, once each: used, dropped, bad, of no motion, passed over for a text beside the motion."""
    several: tuple[str, ...]
    """One line for each row of the CSV that named several motions, to be looked at."""
    notes: tuple[str, ...]
    """One line for each bad row of the CSV or of HumanML3D's index, each row of no motion, and what an archive holds
    beside texts. What concerns one motion stands in its `Described.notes`."""

    def as_dict(self) -> dict[str, Any]:
        """The counts, for JSON."""
        return {"motions": self.motions, "captions": self.captions, "dropped": self.dropped, "rows": self.rows}


def account(describer: Describer, described: Iterable[Described]) -> Account:
    """Adds up the answers of `describer` for all motions, one each."""
    told = list(described)
    by_source: Counter[str] = Counter()
    for one in told:
        by_source[one.source] += len(one.captions)
    rows, row_notes, several = _rows(describer, told)
    humanml3d = describer.humanml3d
    notes = [*row_notes, *((*humanml3d.bad_rows, *humanml3d.notes) if humanml3d else ())]
    return Account(
        _counts(Counter(one.source or "none" for one in told)),
        _counts(+by_source),
        _counts(Counter(kind for one in told for kind in one.dropped)),
        rows,
        tuple(several),
        tuple(notes),
    )


def _rows(describer: Describer, told: list[Described]) -> tuple[dict[str, int], list[str], list[str]]:
    """Counts of the CSV's rows, notes, and rows that named several motions; a row counts once, by the best of it."""
    table = describer.table
    if table is None:
        return {}, [], []
    motions = Counter(number for one in told for number in one.used_rows | one.dropped_rows | one.passed_rows)
    used = {number for one in told for number in one.used_rows}
    dropped = {number for one in told for number in one.dropped_rows}
    counts: Counter[str] = Counter(bad=len(table.bad))
    unused: list[Row] = []
    for row in table.rows:
        fate = "used" if row.number in used else "dropped" if row.number in dropped else "passed over"
        if not motions[row.number]:
            fate = "of no motion"
            unused.append(row)
        counts[fate] += 1
    notes = [*table.bad, *(f"{table.path}, line {row.number}: no motion {row.motion} was read" for row in unused)]
    several = [f"{table.path}, line {row.number}: {row.motion} names {motions[row.number]} motions; a path names one"
               for row in table.rows if motions[row.number] > 1]  # fmt: skip
    return _counts(+counts), notes, several


def _counts(counter: Counter[str]) -> dict[str, int]:
    return dict(sorted(counter.items()))
