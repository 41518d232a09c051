"""Pictures for the reports as SVG text: lines over an axis, and clouds with a measured curve through them."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

INK, GRID, FAINT = "#1d2430", "#e4e7ee", "#6b7385"
COLOURS = {"measured": INK, "before": "#c8553d", "after": "#1b8a6b", "target": "#9aa3b5", "model": "#c8553d"}
NAMES = {"before": "declared model", "after": "corrected model", "oracle": "true effects", "floor": "noise floor"}
"""Names of the document's keys for people."""


@dataclass(frozen=True)
class Frame:
    """A plotting area and the values at its edges."""

    x: tuple[float, float]
    y: tuple[float, float]
    width: float = 640
    height: float = 220
    left: float = 64
    top: float = 28
    bottom: float = 40

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Picture coordinates of a value."""
        u = (x - self.x[0]) / (self.x[1] - self.x[0])
        v = (self.y[1] - y) / (self.y[1] - self.y[0])
        return self.left + u * self.width, self.top + v * self.height


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round values between `low` and `high`, about `count` of them."""
    raw = (high - low) / max(count, 1)
    size = 10.0 ** np.floor(np.log10(raw))
    step = next(size * k for k in (1, 2, 2.5, 5, 10) if size * k >= raw - 1e-12)
    first = np.ceil(low / step - 1e-9) * step
    return [float(round(v, 12)) + 0.0 for v in np.arange(first, high + 1e-9 * step, step)]


def _span(values: Sequence[np.ndarray], pad: float = 0.06) -> tuple[float, float]:
    every = np.concatenate([np.asarray(v, dtype=float).ravel() for v in values])
    every = every[np.isfinite(every)]
    if not len(every):
        return 0.0, 1.0
    low, high = float(every.min()), float(every.max())
    room = pad * (high - low) or 0.5 * abs(high) or 1.0
    return low - room, high + room


def _axes(frame: Frame, x_label: str, y_label: str) -> list[str]:
    x0, x1, y0, y1 = frame.left, frame.left + frame.width, frame.top, frame.top + frame.height
    out = []
    for value in ticks(*frame.x, 6):
        x = frame.at(value, frame.y[0])[0]
        out.append(f"<line x1='{x:.1f}' x2='{x:.1f}' y1='{y0}' y2='{y1}' stroke='{GRID}'/>")
        out.append(f"<text x='{x:.1f}' y='{y1 + 15}' text-anchor='middle' fill='{FAINT}'>{value:.4g}</text>")
    for value in ticks(*frame.y, 4):
        y = frame.at(frame.x[0], value)[1]
        out.append(f"<line x1='{x0}' x2='{x1}' y1='{y:.1f}' y2='{y:.1f}' stroke='{GRID}'/>")
        out.append(f"<text x='{x0 - 7}' y='{y + 4:.1f}' text-anchor='end' fill='{FAINT}'>{value:.4g}</text>")
    middle = 0.5 * (y0 + y1)
    out.append(f"<text x='{0.5 * (x0 + x1):.0f}' y='{y1 + 33}' text-anchor='middle' fill='{FAINT}'>{x_label}</text>")
    turned = f"transform='rotate(-90 14 {middle:.0f})'"
    out.append(f"<text x='14' y='{middle:.0f}' text-anchor='middle' fill='{FAINT}' {turned}>{escape(y_label)}</text>")
    return out


def _svg(frame: Frame, parts: Sequence[str], title: str) -> str:
    width, height = frame.left + frame.width + 14, frame.top + frame.height + frame.bottom
    head = f"<svg viewBox='0 0 {width:.0f} {height:.0f}' role='img' aria-label='{escape(title, quote=True)}'>"
    return head + "".join(parts) + "</svg>"


def line_picture(
    x: Sequence[float], series: dict[str, Sequence[float]], x_label: str, y_label: str, title: str, height: float = 220
) -> str:
    """Lines over a common x; names are keys of `COLOURS`, the last lies on top. Empty where nothing can be drawn."""
    at = np.asarray(x, dtype=float)
    known = {n: np.asarray(v, dtype=float) for n, v in series.items()}
    bounds = _span([v for n, v in known.items() if n in ("measured", "target")] or list(known.values()), 0.0)
    reach = 3.0 * (bounds[1] - bounds[0]) + 1e-9  # a model that runs away must not flatten the rest
    known = {n: np.clip(v, bounds[0] - reach, bounds[1] + reach) for n, v in known.items()}
    if len(at) < 2 or not known:
        return ""
    frame = Frame((float(at[0]), float(at[-1])), _span(list(known.values())), height=height)
    parts = _axes(frame, escape(x_label), y_label)
    for row, (name, values) in enumerate(known.items()):
        good = np.isfinite(values)
        points = " ".join("{:.1f},{:.1f}".format(*frame.at(a, b)) for a, b in zip(at[good], values[good], strict=True))
        dash = " stroke-dasharray='4 3'" if name == "target" else ""
        wide = 2.2 if name == "measured" else 1.8
        parts.append(f"<polyline fill='none' stroke='{COLOURS[name]}' stroke-width='{wide}'{dash} points='{points}'/>")
        x0 = frame.left + 136 * row
        parts.append(f"<rect x='{x0}' y='{frame.top - 16}' width='14' height='3' fill='{COLOURS[name]}'/>")
        parts.append(f"<text x='{x0 + 18}' y='{frame.top - 10}' fill='{COLOURS[name]}'>{NAMES.get(name, name)}</text>")
    return _svg(frame, parts, title)


def curve_picture(rows: Sequence[Sequence[float]], x_label: str, y_label: str, title: str) -> str:
    """A measured curve: rows of x, mean and half-width of its interval."""
    if len(rows) < 3:
        return ""
    x, y, half = np.array(rows, dtype=float).T
    frame = Frame(_span([x]), _span([y - half, y + half, np.zeros(1)]), width=300, height=150, top=14)
    parts = _axes(frame, escape(x_label), y_label)
    for a, b, h in zip(x, y, half, strict=True):
        (px, upper), (_, lower) = frame.at(a, b + h), frame.at(a, b - h)
        parts.append(f"<line x1='{px:.1f}' x2='{px:.1f}' y1='{upper:.1f}' y2='{lower:.1f}' stroke='{FAINT}'/>")
    points = " ".join("{:.1f},{:.1f}".format(*frame.at(a, b)) for a, b in zip(x, y, strict=True))
    parts.append(f"<polyline fill='none' stroke='{INK}' stroke-width='2' points='{points}'/>")
    return _svg(frame, parts, title)


def cloud_picture(x: np.ndarray, y: np.ndarray, x_label: str, y_label: str, title: str, bins: int = 15) -> str:
    """Points (N,) and the mean in equally filled bins with its 95 % interval."""
    keep = np.isfinite(x) & np.isfinite(y)
    x, y = x[keep], y[keep]
    if len(x) < 4 * bins or np.ptp(x) <= 0:
        return ""
    low, high = np.quantile(y, [0.01, 0.99])
    inner = (y >= low) & (y <= high)
    frame = Frame(_span([np.quantile(x, [0.005, 0.995])]), _span([y[inner]]), width=300, height=180)
    parts = _axes(frame, escape(x_label), y_label)
    some = np.random.default_rng(0).permutation(np.flatnonzero(inner))[:500]
    dots = []
    for k in some:
        if frame.x[0] <= x[k] <= frame.x[1]:
            dots.append("<circle cx='{:.1f}' cy='{:.1f}' r='1.3'/>".format(*frame.at(x[k], y[k])))
    parts.append(f"<g fill='{COLOURS['target']}' fill-opacity='.5'>{''.join(dots)}</g>")
    edges = np.unique(np.quantile(x, np.linspace(0, 1, bins + 1)))
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    points = []
    for b in range(len(edges) - 1):
        mine = y[(which == b) & inner]
        if len(mine) < 4:
            continue
        centre, half = float(np.median(x[which == b])), 1.96 * mine.std() / np.sqrt(len(mine))
        px, upper = frame.at(centre, float(mine.mean() + half))
        _, lower = frame.at(centre, float(mine.mean() - half))
        parts.append(f"<line x1='{px:.1f}' x2='{px:.1f}' y1='{upper:.1f}' y2='{lower:.1f}' stroke='{INK}'/>")
        points.append("{:.1f},{:.1f}".format(*frame.at(centre, float(mine.mean()))))
    line = f"<polyline fill='none' stroke='{INK}' stroke-width='2' points='{' '.join(points)}'/>"
    return _svg(frame, [*parts, line], title)
