"""Small helpers for pictures that stand inside one HTML file: matplotlib to SVG or PNG as data URIs, no scripts.

Every figure holds one plot and is as wide as a phone's page: the page lays them side by side where there is room, so
that letters keep their size on any screen.
"""

import base64
import io
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

INK, QUIET, GRID = "#22262b", "#59626d", "#e3e7ec"
PALETTE = ("#d9880f", "#2f6db5", "#3a8f5c", "#a4478f", "#7a6a52", "#c2423b", "#4aa3a8", "#85858f", "#8a6fd1")
WIDTH = 3.35
"""Width of a figure [inch]: 322 CSS pixels."""
SMALLEST = 9.7
"""Size of letters [pt]: 12.9 CSS pixels."""

_STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": SMALLEST,
    "axes.labelsize": SMALLEST,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelsize": SMALLEST,
    "ytick.labelsize": SMALLEST,
    "text.color": INK,
    "text.parse_math": False,  # a name from the data may hold a $
    "legend.frameon": False,
    "legend.fontsize": SMALLEST,
    "svg.hashsalt": "bumblebee",
}


def canvas(height: float = 3.0, width: float = WIDTH) -> tuple[Figure, Axes]:
    """A figure with one pair of axes, in inches."""
    matplotlib.rcParams.update(_STYLE)  # legends and titles, which are made later, read it too
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.add_subplot()


def legend_below(figure: Figure, axis: Axes, columns: int = 2) -> None:
    """A legend under the plot, for which the figure grows: the plot keeps its height. Names too long for it are cut."""
    handles, labels = axis.get_legend_handles_labels()
    if not handles:
        return
    columns = columns if all(len(label) <= 40 // columns for label in labels) else 1
    rows = -(-len(handles) // columns)
    figure.set_figheight(figure.get_figheight() + 0.19 * rows + 0.1)
    figure.legend(handles, [short(label, 40 // columns) for label in labels], loc="outside lower left", ncols=columns,
                  columnspacing=1.0, handletextpad=0.5, borderaxespad=0.2)  # fmt: skip


def svg_uri(figure: Figure) -> str:
    """The figure as a `data:` URI of SVG; as an image it cannot run scripts or clash with other figures' ids."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()


def image_uri(data: bytes, kind: str) -> str:
    """Bytes of an image file as a `data:` URI; `kind` is "png", "webp" ..."""
    return f"data:image/{kind};base64," + base64.b64encode(data).decode()


def colour(index: int) -> str:
    """The palette, repeated."""
    return PALETTE[index % len(PALETTE)]


def short(name: str, most: int) -> str:
    """A name of at most so many letters; one line."""
    name = " ".join(name.split())
    return name if len(name) <= most else name[: most - 1] + "…"


def short_joint(name: str) -> str:
    """`left_knee_joint` -> `L knee`."""
    name = name.removesuffix("_joint").removesuffix("_link")
    for side, letter in (("left_", "L "), ("right_", "R ")):
        if name.startswith(side):
            return letter + name.removeprefix(side).replace("_", " ")
    return name.replace("_", " ")
