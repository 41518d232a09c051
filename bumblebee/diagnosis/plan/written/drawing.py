"""Drawings of a run's targets for the run sheet, one small picture a joint, as SVG text."""

from dataclasses import dataclass
from html import escape

import numpy as np

from bumblebee.diagnosis.plan.plan import Plan

_PANELS = 12  # joints drawn of a run: what fits a page
_INK, _GRID, _FAINT, _LINE, _EDGE = "#1d2430", "#e4e7ee", "#6b7385", "#1f5fa8", "#c8553d"


def panels(plan: Plan, k: int, units: dict[str, dict[str, str]]) -> list[str]:
    """Drawings of the targets of the joints that move most, in the joints' order."""
    machine, motion = plan.machine, plan.motions[k]
    span = np.ptp(motion.targets, axis=0) / np.maximum(plan.limits.high - plan.limits.low, 1e-9)
    drawn = [int(j) for j in np.argsort(-span, kind="stable")[:_PANELS] if machine.moved[j] and span[j] > 1e-3]
    return [_panel(plan, k, j, units[machine.joints[j]]["position"]) for j in sorted(drawn)]


@dataclass(frozen=True)
class _Frame:
    """A picture of a joint's targets over time, and the values at its edges."""

    end: float
    """[s]"""
    bottom: float
    top: float
    width: float = 340.0
    height: float = 112.0
    left: float = 52.0
    right: float = 334.0
    above: float = 16.0
    below: float = 16.0

    def x(self, time: float) -> float:
        """Picture coordinate of a time [s]."""
        return self.left + time / self.end * (self.right - self.left)

    def y(self, value: float) -> float:
        """Picture coordinate of a position."""
        share = (self.top - value) / (self.top - self.bottom)
        return self.above + share * (self.height - self.above - self.below)

    def level(self, value: float, style: str) -> str:
        """A line at a position."""
        y = self.y(value)
        return f"<line x1='{self.left:.1f}' x2='{self.right:.1f}' y1='{y:.1f}' y2='{y:.1f}' {style}/>"

    def text(self, x: float, y: float, anchor: str, words: str) -> str:
        """A small label."""
        return f"<text x='{x:.1f}' y='{y:.1f}' font-size='10' text-anchor='{anchor}' fill='{_FAINT}'>{words}</text>"


def _panel(plan: Plan, k: int, j: int, unit: str) -> str:
    """One joint's targets over time, with the ends of its travel where they are near."""
    machine, name = plan.machine, plan.machine.joints[j]
    y = plan.motions[k].targets[:, j]
    time = np.arange(len(y)) / machine.rate
    room = 0.08 * max(float(np.ptp(y)), 1e-3)
    frame = _Frame(float(time[-1]), float(y.min()) - room, float(y.max()) + room)
    parts = [f"<text x='{frame.left}' y='11' font-size='11' fill='{_INK}'>{escape(name)} [{unit}]</text>"]
    parts += [frame.level(float(v), f"stroke='{_GRID}'") for v in (y.min(), machine.home[j], y.max())]
    parts += [frame.text(frame.left - 4, frame.y(v) + 3.5, "end", f"{v:.3g}") for v in (float(y.max()), float(y.min()))]
    for edge in (float(plan.limits.low[j]), float(plan.limits.high[j])):
        if frame.bottom <= edge <= frame.top:
            parts.append(frame.level(edge, f"stroke='{_EDGE}' stroke-dasharray='4 3'"))
    for t in range(0, int(frame.end) + 1, max(1, int(frame.end) // 4)):
        parts.append(frame.text(frame.x(t), frame.height - 2, "middle", f"{t} s"))
    every = max(1, len(y) // 400)
    points = " ".join(f"{frame.x(t):.1f},{frame.y(v):.1f}" for t, v in zip(time[::every], y[::every], strict=True))
    parts.append(f"<polyline fill='none' stroke='{_LINE}' stroke-width='1.3' points='{points}'/>")
    title = escape(f"targets of {name}", quote=True)
    size = f"0 0 {frame.width:.0f} {frame.height:.0f}"
    return f"<svg viewBox='{size}' role='img' aria-label='{title}'>{''.join(parts)}</svg>"
