"""Report of a diagnosis: a document, a page and lines for the terminal."""

from bumblebee.diagnosis.report.document import Findings, document
from bumblebee.diagnosis.report.effect_entries import at_bounds, effect_entries, law_notes, loss_entries
from bumblebee.diagnosis.report.example_windows import examples
from bumblebee.diagnosis.report.gain_by_horizon import before_and_after, harms
from bumblebee.diagnosis.report.html import (
    NO_INLAY,
    Inlay,
    error_rows,
    figure,
    html_page,
    items,
    number,
    probability,
    shade,
    share_of,
    table,
    warning,
)
from bumblebee.diagnosis.report.left_out import errors_of, shares_left_out
from bumblebee.diagnosis.report.notes import ALONE, far_off, nothing_seen, told_horizon, unseen_notes
from bumblebee.diagnosis.report.page import render_report
from bumblebee.diagnosis.report.prediction_error import (
    HorizonWindows,
    error_block,
    floor_block,
    horizon_whiteners,
    horizon_windows,
)
from bumblebee.diagnosis.report.surface_notes import surface_notes
from bumblebee.diagnosis.report.svg import cloud_picture, line_picture
from bumblebee.diagnosis.report.terminal import gap_summary, missing_lines, plot, summary

__all__ = [
    "ALONE",
    "NO_INLAY",
    "Findings",
    "HorizonWindows",
    "Inlay",
    "at_bounds",
    "before_and_after",
    "cloud_picture",
    "document",
    "effect_entries",
    "error_block",
    "error_rows",
    "errors_of",
    "examples",
    "far_off",
    "figure",
    "floor_block",
    "gap_summary",
    "harms",
    "horizon_whiteners",
    "horizon_windows",
    "html_page",
    "items",
    "law_notes",
    "line_picture",
    "loss_entries",
    "missing_lines",
    "nothing_seen",
    "number",
    "plot",
    "probability",
    "render_report",
    "shade",
    "share_of",
    "shares_left_out",
    "summary",
    "surface_notes",
    "table",
    "told_horizon",
    "unseen_notes",
    "warning",
]
