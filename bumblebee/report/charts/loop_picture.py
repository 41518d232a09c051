"""The loop as a picture: its stages as boxes with this run's own numbers in them.

Drawn as SVG by hand for a wide page, and as two lists whose boxes wrap for a narrow one; the page shows one of them.
"""

from dataclasses import dataclass
from html import escape

from bumblebee.report.charts.figures import INK, PALETTE, QUIET

_WIDTH, _HEIGHT, _GAP = 128, 58, 22


@dataclass(frozen=True)
class Box:
    """One stage: `title`, and a line about what came out of it."""

    title: str
    note: str
    kind: str = "data"
    """"data", "learn", "robot" or "person": the colour."""


_COLOURS = {"data": "#eef1f5", "learn": "#fdeccb", "robot": "#dfeaf6", "person": "#e3f1e7"}


def loop_picture(first_row: list[Box], second_row: list[Box], caption: str) -> str:
    """Markup: curation and training on top, and the round with the robot below, coming back to the experts.

    Args:
        first_row: stages from motions to registry, left to right.
        second_row: the stages of a round, drawn right to left below, from the robot back to the refined expert.
        caption: what the arrow back says.
    """
    wide, narrow = _wide(first_row, second_row, caption), _narrow(first_row, second_row, caption)
    return f'<div class="loop-wide">{wide}</div><div class="loop-narrow">{narrow}</div>'


def _narrow(first_row: list[Box], second_row: list[Box], caption: str) -> str:
    """Two lists, the second under the caption."""
    lists = _list(first_row)
    return lists if not second_row else f"{lists}<p>{escape(caption)}, back to the experts:</p>{_list(second_row)}"


def _list(boxes: list[Box]) -> str:
    items = "".join(
        f'<li style="background:{_COLOURS[box.kind]}"><b>{escape(box.title)}</b><span>{escape(box.note)}</span></li>'
        for box in boxes
    )
    return f'<ol class="loop">{items}</ol>'


def _wide(first_row: list[Box], second_row: list[Box], caption: str) -> str:
    columns = max(len(first_row), len(second_row))
    width, height = columns * (_WIDTH + _GAP) + _GAP, 2 * _HEIGHT + 100
    parts = [
        f'<svg viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg" role="img" '
        f'aria-label="{escape(_in_words(first_row, second_row, caption))}" '
        f'style="width:100%;max-width:{1.25 * width:.0f}px;font:13.5px system-ui,sans-serif">'
        f'<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" '
        f'markerWidth="7" markerHeight="7" orient="auto"><path d="M0 0 8 4 0 8z" fill="{QUIET}"/></marker></defs>'
    ]
    for i, box in enumerate(first_row):
        x = _GAP + i * (_WIDTH + _GAP)
        parts.append(_box(x, 16, box))
        if i + 1 < len(first_row):
            parts.append(_arrow(x + _WIDTH, 16 + _HEIGHT / 2, x + _WIDTH + _GAP, 16 + _HEIGHT / 2))
    low = _HEIGHT + 84
    anchor = next((i for i, box in enumerate(first_row) if box.title == "experts"), 0)
    for i, box in enumerate(second_row):
        x = _GAP + (len(second_row) - 1 - i) * (_WIDTH + _GAP)
        parts.append(_box(x, low, box))
        if i + 1 < len(second_row):
            parts.append(_arrow(x, low + _HEIGHT / 2, x - _GAP, low + _HEIGHT / 2))
    if second_row:
        centre = _GAP + anchor * (_WIDTH + _GAP) + _WIDTH / 2
        right = _GAP + (len(second_row) - 1) * (_WIDTH + _GAP) + _WIDTH / 2
        left = _GAP + _WIDTH / 2
        middle = 16 + _HEIGHT + (low - 16 - _HEIGHT) / 2
        parts.append(_path(f"M{centre + 12} {16 + _HEIGHT} V{middle - 9} H{right} V{low}"))
        parts.append(_path(f"M{left} {low} V{middle + 9} H{centre - 12} V{16 + _HEIGHT}"))
        parts.append(f'<text x="{left + 10}" y="{middle + 1}" fill="{PALETTE[0]}">{escape(caption)}</text>')
    return "".join(parts) + "</svg>"


def _in_words(first_row: list[Box], second_row: list[Box], caption: str) -> str:
    rows = ["; ".join(f"{box.title}: {box.note}" for box in row) for row in (first_row, second_row) if row]
    return f"The loop. {f'. {caption}: '.join(rows)}."


def _box(x: float, y: float, box: Box) -> str:
    return (
        f'<g><rect x="{x}" y="{y}" width="{_WIDTH}" height="{_HEIGHT}" rx="7" fill="{_COLOURS[box.kind]}" '
        f'stroke="{QUIET}" stroke-opacity=".45"/>'
        f'<text x="{x + _WIDTH / 2}" y="{y + 23}" text-anchor="middle" font-weight="650" fill="{INK}">'
        f"{escape(box.title)}</text>"
        f'<text x="{x + _WIDTH / 2}" y="{y + 43}" text-anchor="middle" font-size="12.5" fill="{QUIET}">'
        f"{escape(box.note)}</text></g>"
    )


def _arrow(x1: float, y1: float, x2: float, y2: float) -> str:
    return _path(f"M{x1} {y1} L{x2} {y2}")


def _path(d: str) -> str:
    return f'<path d="{d}" fill="none" stroke="{QUIET}" stroke-width="1.3" marker-end="url(#tip)"/>'
