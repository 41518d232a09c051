"""Small helpers for pictures that stand inside one HTML file: matplotlib to SVG or PNG as data URIs, no scripts."""

import base64
import io
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

INK, QUIET, GRID = "#22262b", "#6b7480", "#e3e7ec"
PALETTE = ("#d9880f", "#2f6db5", "#3a8f5c", "#a4478f", "#7a6a52", "#c2423b", "#4aa3a8", "#85858f")

_STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 9.5,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "text.color": INK,
    "legend.frameon": False,
    "svg.hashsalt": "bumblebee",
}


def canvas(columns: int = 1, width: float = 10.3, height: float = 3.2) -> tuple[Figure, list[Axes]]:
    """A figure of `columns` axes side by side, in inches; by default as wide as the page."""
    matplotlib.rcParams.update(_STYLE)  # legends and titles, which are made later, read it too
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, [figure.add_subplot(1, columns, i + 1) for i in range(columns)]


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


def short_joint(name: str) -> str:
    """`left_knee_joint` -> `L knee`."""
    name = name.removesuffix("_joint").removesuffix("_link")
    for side, letter in (("left_", "L "), ("right_", "R ")):
        if name.startswith(side):
            return letter + name.removeprefix(side).replace("_", " ")
    return name.replace("_", " ")
