"""Figures with intervals on the pages of results are those of the tables that commands wrote."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[3] / "docs"
RESULTS = DOCS / "results"
FIGURE = re.compile(r"[-+]?\d\.\d+ \[[-+]?\d\.\d+, [-+]?\d\.\d+\]")
NUMBER = r"([-+]?\d?\.\d+)"
ROUNDED = re.compile(rf"{NUMBER} \[{NUMBER}, {NUMBER}\]")


def test_every_figure_with_an_interval_stands_in_the_tables_of_the_run():
    page, *tables = ((RESULTS / name).read_text() for name in ("method.md", "method-tables.md", "learner-tables.md"))
    said = FIGURE.findall(page)
    assert len(said) > 50
    assert [figure for figure in said if not any(figure in table for table in tables)] == []
    for table in tables:
        stamps = re.match(r"<!-- methods? ([\w ]+), motions (\w+) -->", table)
        assert stamps and all(stamp in page for group in stamps.groups() for stamp in group.split())


def test_every_figure_of_the_page_of_claims_stands_rounded_on_one_of_its_pages():
    pages = [figures(page.read_text()) for page in sorted(RESULTS.glob("*.md"))]
    known, said = [figure for page in pages for figure in page], figures((DOCS / "results.md").read_text())
    assert len(said) > 40
    assert [figure for figure in said if not any(rounds_to(other, figure) for other in known)] == []


def figures(text: str) -> list[tuple[float, ...]]:
    """Value and both ends of its interval, of every figure in a text."""
    return [tuple(float(number) for number in found.groups()) for found in ROUNDED.finditer(text)]


def rounds_to(exact: tuple[float, ...], short: tuple[float, ...]) -> bool:
    return all(abs(one - two) < 0.00501 for one, two in zip(exact, short, strict=True))
