"""Figures with intervals on the page of the whole method are those of the tables that its command wrote."""

import re
from pathlib import Path

RESULTS = Path(__file__).parents[2] / "docs" / "results"
FIGURE = re.compile(r"[-+]?\d\.\d+ \[[-+]?\d\.\d+, [-+]?\d\.\d+\]")


def test_every_figure_with_an_interval_stands_in_the_tables_of_the_run():
    page, tables = ((RESULTS / name).read_text() for name in ("method.md", "method-tables.md"))
    said = FIGURE.findall(page)
    assert len(said) > 50
    assert [figure for figure in said if figure not in tables] == []
    stamps = re.match(r"<!-- method (\w+), motions (\w+) -->", tables)
    assert stamps and all(stamp in page for stamp in stamps.groups())
