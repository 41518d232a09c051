"""Series of different rates and topics on one grid: a sampled state and the command in force in every row.

Rows are the stamps of the joint states, or of the commands if the map says so; where joints come in messages apart, of
those that hold most joints. A command is held: in row k stands the
latest that came at or before time[k]. A state of other stamps is interpolated linearly between its neighbours; those
of the grid's own topic stay as they were measured. Rows before every series has begun, after a state has ended, and
later than the last command by more than its longest pause, when nobody says what the drive does, are left out.
"""

from dataclasses import dataclass, replace

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.column_map import COMMANDED, ColumnMap

_NS = 1e-9


@dataclass(frozen=True)
class Series:
    """Messages of one topic as numbers."""

    column: str
    """Column of the contract."""
    topic: str
    stamps: np.ndarray
    """(T,) [ns], int64, as they came."""
    values: np.ndarray
    """(T, P), one a place."""
    places: tuple[int, ...]
    """Which joints of the map, or components of the column, the values are."""
    numbers: np.ndarray
    """(T,) the messages' numbers in the file, over all topics."""
    notes: tuple[str, ...] = ()


def on_one_grid(
    where: str, series: list[Series], chosen: ColumnMap
) -> tuple[np.ndarray, dict[str, np.ndarray], tuple[str, ...]]:
    """Stamps (T,) [s from the first row], column -> (T, width), and what was done, for the notes."""
    notes = tuple(dict.fromkeys(note for one in series for note in (*one.notes, *_out_of_order(one))))
    ordered = [_in_order(one) for one in series]
    base = _base(where, ordered, chosen.grid)
    begin = max(int(one.stamps[0]) for one in ordered)
    end = min(_end(one) for one in ordered)
    rows = np.unique(base.stamps[(base.stamps >= begin) & (base.stamps <= end)])
    if len(rows) < 2:
        spans = ", ".join(f"{one.topic} {(one.stamps[-1] - one.stamps[0]) * _NS:.3f} s" for one in ordered)
        raise BadInput(where, "states and commands of the same time", f"none that overlap ({spans})"[:300])
    values: dict[str, np.ndarray] = {}
    taken: set[tuple[str, int]] = set()
    for one in ordered:
        part = _held(one, rows) if one.column in COMMANDED else _sampled(one, rows)
        values.setdefault(one.column, np.zeros((len(rows), chosen.width(one.column))))[:, one.places] = part
        twice = taken & {(one.column, place) for place in one.places}
        if twice:
            raise BadInput(f"{where}: {one.column}", "each joint once", f"joint {chosen.joints[min(twice)[1]]} twice")
        taken |= {(one.column, place) for place in one.places}
    return (rows - rows[0]) * _NS, values, notes + _rates(base, rows, ordered)


def _out_of_order(one: Series) -> list[str]:
    """Notes on messages whose stamps are not later than those before them."""
    steps = np.diff(one.stamps)
    counts = (
        ("older than the one before, sorted", steps < 0),
        ("with the stamp of the one before, the last counts", steps == 0),
    )
    return [f"{one.topic}: {n} messages {what}" for what, which in counts if (n := int(which.sum()))]


def _in_order(one: Series) -> Series:
    """By stamps; of equal ones the last counts."""
    order = np.argsort(one.stamps, kind="stable")
    stamps = one.stamps[order]
    last = np.append(stamps[1:] != stamps[:-1], True)
    return replace(one, stamps=stamps[last], values=one.values[order][last], numbers=one.numbers[order][last])


def _base(where: str, series: list[Series], by: str) -> Series:
    """The series whose stamps are the rows: of joints in messages apart the one that holds most of them."""
    wanted = ("joint_pos",) if by == "states" else ("joint_target", "joint_torque_cmd", "feed_forward")
    found = [one for column in wanted for one in series if one.column == column]
    if not found:
        raise BadInput(where, f"a column of {wanted[0]}, whose stamps are the rows", "none")
    return max(found, key=lambda one: len(one.places))


def _end(one: Series) -> int:
    """The last stamp for which the series says something."""
    if one.column not in COMMANDED:
        return int(one.stamps[-1])
    pauses = np.diff(one.stamps)
    return int(one.stamps[-1]) + int(pauses.max()) if len(pauses) else np.iinfo(np.int64).max


def _held(one: Series, rows: np.ndarray) -> np.ndarray:
    return one.values[np.searchsorted(one.stamps, rows, side="right") - 1]


def _sampled(one: Series, rows: np.ndarray) -> np.ndarray:
    """States at the rows; quaternions by the shorter way and of length 1."""
    right = np.clip(np.searchsorted(one.stamps, rows, side="left"), 0, len(one.stamps) - 1)
    left = np.where(one.stamps[right] == rows, right, right - 1)
    gap = (one.stamps[right] - one.stamps[left]).astype(np.float64)
    share = np.where(gap > 0, (rows - one.stamps[left]) / np.where(gap > 0, gap, 1.0), 0.0)[:, None]
    first, second = one.values[left], one.values[right]
    if one.column != "base_quat":
        with np.errstate(all="ignore"):
            return np.where(share > 0, (1 - share) * first + share * second, first)
    with np.errstate(all="ignore"):
        second = np.where((first * second).sum(axis=1, keepdims=True) < 0, -second, second)
        between = (1 - share) * first + share * second
        between = between / np.linalg.norm(between, axis=1, keepdims=True)
        return np.where(share > 0, between, first)


def _rates(base: Series, rows: np.ndarray, series: list[Series]) -> tuple[str, ...]:
    """How often each topic came, and how many commands no row shows."""
    notes = {}
    for one in series:
        if one.topic == base.topic or len(one.stamps) < 2:
            continue
        rate = 1 / (float(np.median(np.diff(one.stamps))) * _NS)
        way = "held" if one.column in COMMANDED else "interpolated"
        between = 0
        if one.column in COMMANDED:
            inside = one.stamps[(one.stamps > rows[0]) & (one.stamps <= rows[-1])]
            between = len(inside) - len(np.unique(np.searchsorted(rows, inside, side="left")))
        lost = f", {between} of {len(one.stamps)} messages fell between two rows" if between else ""
        notes[one.topic] = f"{one.topic} at {rate:.4g} Hz {way} on the rows of {base.topic}{lost}"
    return tuple(notes.values())
