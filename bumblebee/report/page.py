"""The report as one self-contained HTML file: sections of texts, tables and images through one template.

Every text is escaped, images are `data:` URIs, and the page's own policy forbids scripts and anything from outside.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from jinja2 import Environment, select_autoescape
from markupsafe import Markup


@dataclass(frozen=True)
class Cell:
    """A table's cell with a mark: "found", "missed" or ""."""

    text: str
    mark: str = ""


@dataclass(frozen=True)
class Block:
    """One piece of a section; which fields count depends on `kind`: text, note, heading, list, image or table."""

    kind: str
    text: str = ""
    lines: tuple[str, ...] = ()
    uri: str = ""
    caption: str = ""
    header: tuple[str, ...] = ()
    rows: tuple[tuple[str | Cell, ...], ...] = ()


@dataclass(frozen=True)
class Section:
    """A heading with blocks under it."""

    id: str
    title: str
    blocks: tuple[Block, ...]


def text(words: str) -> Block:
    """A paragraph."""
    return Block("text", text=words)


def note(words: str) -> Block:
    """A paragraph in small print."""
    return Block("note", text=words)


def heading(words: str) -> Block:
    """A heading inside a section."""
    return Block("heading", text=words)


def bullets(lines: Sequence[str]) -> Block:
    """A list."""
    return Block("list", lines=tuple(lines))


def image(uri: str, caption: str) -> Block:
    """A picture as a `data:` URI."""
    if not uri.startswith("data:image/"):
        raise ValueError("a report holds its images in itself")
    return Block("image", uri=uri, caption=caption)


def table(header: Sequence[str], rows: Sequence[Sequence[str | Cell]], caption: str = "") -> Block:
    """A table."""
    return Block("table", header=tuple(header), rows=tuple(tuple(row) for row in rows), caption=caption)


def render(title: str, subtitle: str, verdict: Sequence[str], picture_svg: str, sections: Sequence[Section]) -> str:
    """The page; `picture_svg` is the only markup that is passed through, and must come from `loop_picture`."""
    environment = Environment(autoescape=select_autoescape(default=True), trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string(files("bumblebee.report").joinpath("page.html.j2").read_text())
    return template.render(
        title=title, subtitle=subtitle, verdict=list(verdict), picture=Markup(picture_svg), sections=list(sections)
    )
