"""The report as one self-contained HTML file: sections of texts, tables and pictures through one template.

Every text is escaped and pictures are `data:` URIs. The page's own policy forbids everything from outside and every
script but its own, the film's player and the map, which it names by their hash; a page with neither runs none.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from itertools import groupby

from jinja2 import Environment, select_autoescape
from markupsafe import Markup

from bumblebee.io.page_policy import policy
from bumblebee.report.charts.chart import Strip
from bumblebee.report.films.filmstrip import Sheet
from bumblebee.report.replays import replay as replays_of
from bumblebee.report.replays.replay_page import holder, style


@dataclass(frozen=True)
class Cell:
    """A table's cell with a mark: "found", "missed" or "", and a share from 0 to 1 that shades it."""

    text: str
    mark: str = ""
    shade: float | None = None
    tip: str = ""
    """Words that pointing at it shows."""


@dataclass(frozen=True)
class Share:
    """A share from 0 to 1 with its 95 % interval, and in words."""

    value: float
    low: float
    high: float
    words: str


@dataclass(frozen=True)
class Bar:
    """A share with its interval as a bar; `None` where it was not measured."""

    called: str
    note: str
    robot: Share | None
    declared: Share | None
    quiet: bool = False
    """Drawn paler: a control."""


@dataclass(frozen=True)
class Block:
    """One piece of a section; which fields count depends on `kind`.

    Kinds: text, note, heading, list, button, table, film, replay, map, bars, strips, curves, warning, pairs (a table
    whose rows stack on a phone); and, side by side where there is room: image, still.
    """

    kind: str
    text: str = ""
    lines: tuple[str, ...] = ()
    uri: str = ""
    title: str = ""
    caption: str = ""
    alt: str = ""
    header: tuple[str, ...] = ()
    rows: tuple[tuple[str | Cell, ...], ...] = ()
    sheet: Sheet | None = None
    bars: tuple[Bar, ...] = ()
    strips: tuple[Strip, ...] = ()
    folded: str = ""
    """Title of a table that opens on a click."""
    panels: tuple[str, ...] = ()
    """Headings over the parts of a film that stand side by side in it."""
    facts: dict[str, str] = field(default_factory=dict)
    """Facts for the script of a map."""
    choices: tuple[tuple[str, str], ...] = ()
    """Columns that a map's points can be coloured by, each with its name on the page."""
    player: str = ""
    """Markup of `replay_page.player`: a replay, or a map's for the motion that is pointed at."""


@dataclass(frozen=True)
class Section:
    """A heading with blocks under it."""

    id: str
    title: str
    blocks: tuple[Block, ...]

    @property
    def parts(self) -> list["Part"]:
        """Blocks under each heading: what the page lays out side by side."""
        parts: list[list[Block]] = [[]]
        for block in self.blocks:
            if block.kind == "heading" and parts[-1]:
                parts.append([])
            parts[-1].append(block)
        return [Part(tuple(part)) for part in parts]


@dataclass(frozen=True)
class Part:
    """A heading and what follows up to the next."""

    blocks: tuple[Block, ...]

    @property
    def lead(self) -> bool:
        """Whether these are introductory words alone, which stand above the other parts."""
        return all(block.kind in ("text", "note", "warning") for block in self.blocks)

    @property
    def aside(self) -> bool:
        """Whether it stands in the first screen's second column: a film, its stills, a list of differences."""
        return any(block.kind in ("film", "still", "list") for block in self.blocks)

    @property
    def runs(self) -> list[tuple[str, list[Block]]]:
        """Blocks in runs of one kind: figures beside each other, the rest below each other."""
        return [(name, list(run)) for name, run in groupby(self.blocks, key=_row)]


_SCRIPTS = (
    ("film", "player.js"),
    ("replay", "replay.js"),
    ("map", "map.js"),
    ("curves", "curves.js"),
    ("live", "live.js"),
)


def _row(block: Block) -> str:
    return {"image": "figures", "curves": "figures", "still": "stills"}.get(block.kind, "flow")


def text(words: str) -> Block:
    """A paragraph."""
    return Block("text", text=words)


def note(words: str) -> Block:
    """A paragraph in small print."""
    return Block("note", text=words)


def warning(words: str) -> Block:
    """A paragraph about something that went the wrong way."""
    return Block("warning", text=words)


def heading(words: str) -> Block:
    """A heading inside a section."""
    return Block("heading", text=words)


def bullets(lines: Sequence[str]) -> Block:
    """A list."""
    return Block("list", lines=tuple(lines))


def button(words: str, path: str) -> Block:
    """A button that sends nothing but itself to a path of the page's own server."""
    return Block("button", text=words, uri=path)


def image(uri: str, title: str, caption: str = "", alt: str = "") -> Block:
    """A figure as a `data:` URI; `alt` says in words what it shows, by default its title and caption."""
    return Block("image", uri=_inside(uri), title=title, caption=caption, alt=alt or f"{title}. {caption}".strip())


def still(uri: str, caption: str, alt: str) -> Block:
    """A small picture, one of a row."""
    return Block("still", uri=_inside(uri), caption=caption, alt=alt)


def film(sheet: Sheet, title: str, caption: str, alt: str, panels: Sequence[str] = ()) -> Block:
    """A film with its player; `panels` are headings over its parts, where it shows several side by side."""
    uri = _inside(sheet.uri)
    return Block("film", uri=uri, title=title, caption=caption, alt=alt, sheet=sheet, panels=tuple(panels))


def bars(rows: Sequence[Bar], header: Sequence[str], title: str, caption: str = "") -> Block:
    """Shares as bars: `header` says what the robot's and the declared model's are called, "" leaves a column out."""
    return Block("bars", bars=tuple(rows), header=tuple(header), title=title, caption=caption)


def pairs(header: Sequence[str], rows: Sequence[Sequence[str | Cell]], title: str, caption: str = "") -> Block:
    """A table of few columns whose cells stand below each other, with their column's name, on a phone."""
    filled = tuple(tuple(row) for row in rows)
    return Block("pairs", header=tuple(header), rows=filled, title=title, caption=caption)


def replay(player: str) -> Block:
    """A 3D replay by `replay_page.player`."""
    return Block("replay", player=player)


def _inside(uri: str) -> str:
    if not uri.startswith("data:image/"):
        raise ValueError("a report holds its images in itself")
    return uri


def strips(rows: Sequence[Strip], ends: Sequence[str], legend: Sequence[tuple[str, str]], title: str) -> Block:
    """A chart of rows; `ends` are the axis' ends in words, `legend` each tone and what it means."""
    return Block("strips", strips=tuple(rows), header=tuple(ends), choices=tuple(legend), title=title)


def table(
    header: Sequence[str], rows: Sequence[Sequence[str | Cell]], caption: str = "", title: str = "", folded: str = ""
) -> Block:
    """A table; `title` names it for a screen reader, `folded` is the line that opens it."""
    filled, named = tuple(tuple(row) for row in rows), title or ", ".join(header[:2])
    return Block("table", header=tuple(header), rows=filled, caption=caption, title=named, folded=folded)


def render(
    title: str,
    subtitle: str,
    picture: str,
    sections: Sequence[Section],
    opening: Section | None = None,
    replays: replays_of.Part | None = None,
    live: bool = False,
) -> str:
    """The page; of markup only `loop_picture`'s and `replay_page`'s is passed through.

    A `live` one looks at its own address again and again, and shows the sections that it finds there.
    """
    environment = Environment(autoescape=select_autoescape(default=True), trim_blocks=True, lstrip_blocks=True)
    folder = files("bumblebee.report")
    every = [*sections, *([opening] if opening else [])]
    blocks = [block for section in every for block in section.blocks]
    kinds = {block.kind for block in blocks} | ({"replay"} if any(block.player for block in blocks) else set())
    kinds |= {"live"} if live else set()
    script = "\n".join(folder.joinpath(file).read_text() for kind, file in _SCRIPTS if kind in kinds)
    return environment.from_string(folder.joinpath("page.html.j2").read_text()).render(
        title=title,
        subtitle=subtitle,
        opening=opening,
        picture=Markup(picture),
        sections=list(sections),
        style=Markup(folder.joinpath("page.css").read_text() + (style() if "replay" in kinds else "")),
        replays=holder(replays) if replays else "",
        script=Markup(script),
        policy=policy(script, live),
        live=live,
    )
