"""The picture of the library's rooms, drawn from its imports: python -m tests.rooms_picture writes docs/rooms.svg."""

from html import escape
from pathlib import Path

from tests.import_graph import FLOORS, graph, reached

HOME = Path(__file__).parent.parent
PICTURE = HOME / "docs" / "rooms.svg"
WIDTH, HIGH, BOX, TALL, SHIFT = 900, 78, 118, 34, 70  # px: page, floor, box


def rooms() -> dict[str, set[str]]:
    """Room -> the rooms below it that it imports itself, without those that another of these reaches."""
    direct: dict[str, set[str]] = {room: set() for floor in FLOORS for room in floor}
    for module, imported in graph(HOME, late=True).items():
        for other in imported:
            one, two = _room(module), _room(other)
            if one != two and one in direct and two in direct:
                direct[one].add(two)
    return {room: {low for low in below if not _by_another(low, below, direct)} for room, below in direct.items()}


def drawn() -> str:
    """The picture as SVG: a row a floor, the lowest at the bottom; a line from a room to each that it stands on."""
    places = {}
    for level, floor in enumerate(FLOORS):
        for index, room in enumerate(sorted(floor)):
            aside = SHIFT * (level % 3 - 1)  # a line to a far floor does not end behind a box
            places[room] = ((index + 0.5) * WIDTH / len(floor) + aside, (len(FLOORS) - level - 0.5) * HIGH)
    lines = [_line(places[room], places[low]) for room, below in sorted(rooms().items()) for low in sorted(below)]
    boxes = [_box(room, *places[room]) for room in sorted(places)]
    style = (
        "path{fill:none;stroke:#8a94a6;stroke-width:1.4}.far{stroke-dasharray:5 4}"
        "rect{fill:#fff7e0;stroke:#b58900;rx:6}text{font:15px sans-serif;text-anchor:middle;fill:#222}"
    )
    size = f'viewBox="0 0 {WIDTH} {len(FLOORS) * HIGH}"'
    ends = 'markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto"'
    tip = f'<marker id="tip" {ends}><path d="M1 1L7 4L1 7"/></marker>'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img"><title>Rooms of bumblebee</title>'
    return "\n".join([head, f"<style>{style}</style>", f"<defs>{tip}</defs>", *lines, *boxes, "</svg>", ""])


def _room(module: str) -> str:
    parts = module.split(".")
    return parts[1] if parts[0] == "bumblebee" and len(parts) > 1 else ""


def _by_another(low: str, below: set[str], direct: dict[str, set[str]]) -> bool:
    return any(low in reached(direct, other) for other in below - {low})


def _line(high: tuple[float, float], low: tuple[float, float]) -> str:
    (x, y), (u, v) = (high[0], high[1] + TALL / 2), (low[0], low[1] - TALL / 2)
    bend = (v - y) / 2
    far = ' class="far"' if v - y > HIGH else ""
    curve = f"M{x:.0f} {y:.0f}C{x:.0f} {y + bend:.0f} {u:.0f} {v - bend:.0f} {u:.0f} {v:.0f}"
    return f'<path{far} d="{curve}" marker-end="url(#tip)"/>'


def _box(room: str, x: float, y: float) -> str:
    rect = f'<rect x="{x - BOX / 2:.0f}" y="{y - TALL / 2:.0f}" width="{BOX}" height="{TALL}"/>'
    return f'{rect}<text x="{x:.0f}" y="{y + 5:.0f}">{escape(room)}</text>'


if __name__ == "__main__":
    PICTURE.write_text(drawn())
