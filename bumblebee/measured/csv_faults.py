"""Faults of a CSV file that pandas cannot read, or reads with its columns shifted: a line, and the remedy."""

import re

import pandas as pd

from bumblebee.errors import BadInput

_HEADER = "What stands above the header must go, and so must a separator at the end of rows."
_FIELDS = re.compile(r"Expected (\d+) fields in line (\d+), saw (\d+)")
_QUOTE = re.compile(r"EOF inside string starting at row (\d+)")


def csv_fault(where: object, content: bytes, error: Exception) -> BadInput:
    """The line for an exception of pandas' parser; lines of the file count from 1."""
    said = str(error)
    if isinstance(error, UnicodeDecodeError):
        line, sign = _no_text(content)
        return BadInput(f"{where}: line {line}", "text in UTF-8", f"the byte 0x{sign:02x}", "Save it as UTF-8.")
    if isinstance(error, pd.errors.EmptyDataError):
        return BadInput(where, "a header and rows", "an empty file", "Take it out of what is imported.")
    if found := _FIELDS.search(said):
        expected = f"{found[1]} fields, as in the lines above it"
        return BadInput(f"{where}: line {found[2]}", expected, found[3], f"Mend or remove the line. {_HEADER}")
    if found := _QUOTE.search(said):
        return BadInput(f"{where}: line {int(found[1]) + 1}", "a quoted cell that ends", "a quote that is never closed")
    return BadInput(where, "a CSV file with a header", f"one that cannot be read ({said})"[:200])


def require_unshifted(where: object, table: pd.DataFrame) -> pd.DataFrame:
    """The table, if its rows have as many cells as the header has names.

    Of rows with more cells pandas takes the first ones for an index, and every name then stands over its neighbour.
    """
    if not isinstance(table.index, pd.RangeIndex):
        names = len(table.columns)
        shown = ", ".join(map(str, table.columns[:6]))[:120]
        expected = f"{names} cells a row, as the header has names ({shown})"
        raise BadInput(where, expected, f"{names + table.index.nlevels}", _HEADER)
    return table


def _no_text(content: bytes) -> tuple[int, int]:
    """Line, from 1, and value of the first byte that is no UTF-8."""
    try:
        content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        # The byte order mark that the codec skips is not counted in its positions.
        start = error.start + (3 if content.startswith(b"\xef\xbb\xbf") else 0)
        return content[:start].count(b"\n") + 1, content[min(start, len(content) - 1)]
    return 1, content[0]
