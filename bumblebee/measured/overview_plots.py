"""How well each joint followed its targets, as SVG that stands alone: no script, no style sheet, any width.

Every string that came from outside is escaped. Hinges are in rad and mrad, slides in m and mm, never in one picture.
"""

from base64 import b64encode
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from html import escape
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.measured.model_file import load_model
from bumblebee.measured.rollout import Rollout

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 360, 150, 40, 8, 22, 18  # of a picture; it is as wide as a telephone
NAMES, ROW = 160, 18  # of the bars: width of the names, height of a row
POINTS = 240  # drawn of one curve: more than a telephone's pixels add nothing
FONT = "font-family='system-ui,sans-serif' font-size='11' fill='#4a5568'"


@dataclass(frozen=True)
class Trace:
    """Command and measurement of the joint that follows worst, in one rollout of a motion."""

    motion: str
    joint: str
    error: float
    """RMS of target minus position [rad], [m] for a slide."""
    time: np.ndarray
    command: np.ndarray
    measured: np.ndarray


def slides(model: Path) -> frozenset[str]:
    """Names of the model's slide joints; none where there is no model."""
    if not model.is_file():
        return frozenset()
    loaded = load_model(model)
    kinds = loaded.jnt_type
    return frozenset(loaded.joint(j).name for j in range(loaded.njnt) if kinds[j] == mujoco.mjtJoint.mjJNT_SLIDE)


def tracking(rollouts: Iterable[Rollout]) -> tuple[dict[str, float], list[Trace]]:
    """RMS of target minus position by joint [rad], [m] for slides, and the worst joint of each motion's first."""
    sums: dict[str, tuple[float, int]] = {}
    traces: dict[str, Trace] = {}
    for rollout in rollouts:
        if rollout.joint_target is None:
            continue
        square = (rollout.joint_target - rollout.joint_pos) ** 2
        for joint, name in enumerate(rollout.joints):
            total, ticks = sums.get(name, (0.0, 0))
            sums[name] = total + float(square[:, joint].sum()), ticks + len(square)
        means = square.mean(axis=0)
        worst, motion = int(np.argmax(means)), str(rollout.meta.get("motion", rollout.rollout_id))
        if motion not in traces:
            pair = rollout.joint_target[:, worst], rollout.joint_pos[:, worst]
            time = rollout.time - rollout.time[0]
            traces[motion] = Trace(motion, rollout.joints[worst], float(np.sqrt(means[worst])), time, *pair)
    errors = {name: float(np.sqrt(total / max(ticks, 1))) for name, (total, ticks) in sums.items()}
    return errors, sorted(traces.values(), key=lambda trace: -trace.error)


def by_unit(errors: dict[str, float], slides: Collection[str]) -> list[tuple[str, str, dict[str, float]]]:
    """(what, unit, joint -> error in that unit, largest first) for hinges and for slides, where there are any."""
    groups = []
    for what, unit, slide in (("Hinges", "mrad", False), ("Slides", "mm", True)):
        of = {name: 1000 * value for name, value in errors.items() if (name in slides) == slide}
        if of:
            groups.append((what, unit, dict(sorted(of.items(), key=lambda pair: -pair[1]))))
    return groups


def rounded(value: float) -> str:
    """Three digits that count, without an exponent."""
    digits = next((digits for digits, least in enumerate((100, 10, 1)) if abs(value) >= least), 3)
    return f"{value:.{digits}f}"


def bars(errors: dict[str, float], unit: str) -> str:
    """A bar for each joint, in the order given; values in `unit`."""
    largest, rows = max(errors.values()) or 1.0, []
    room = WIDTH - NAMES - 75
    for row, (name, value) in enumerate(errors.items()):
        y, length = ROW * row, room * value / largest
        shown = name if len(name) <= 27 else f"{name[:26]}…"
        rows.append(f"<text x='0' y='{y + 13}' {FONT}>{escape(shown)}</text>")
        rows.append(f"<rect x='{NAMES}' y='{y + 3}' width='{length:.1f}' height='12' fill='#d99a00'/>")
        rows.append(f"<text x='{NAMES + 5 + length:.1f}' y='{y + 13}' {FONT}>{rounded(value)} {unit}</text>")
    return _svg(ROW * len(errors) + 4, "tracking error by joint", "".join(rows))


def plot(trace: Trace, slide: bool, headed: bool = True) -> str:
    """Command (grey) and measurement (orange) over time; `headed` where nothing else says whose they are."""
    low = float(min(trace.command.min(), trace.measured.min()))
    high = float(max(trace.command.max(), trace.measured.max()))
    span, end = (high - low) or 1.0, float(trace.time[-1]) or 1.0
    keep = np.unique(np.linspace(0, len(trace.time) - 1, min(len(trace.time), POINTS)).astype(int))
    x = LEFT + trace.time[keep] / end * (WIDTH - LEFT - RIGHT)

    def line(values: np.ndarray, colour: str) -> str:
        y = HEIGHT - BOTTOM - (values[keep] - low) / span * (HEIGHT - TOP - BOTTOM)
        points = "L".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        return f"<path d='M{points}' fill='none' stroke='{colour}' stroke-width='1.3'/>"

    position, error = ("m", "mm") if slide else ("rad", "mrad")
    label = f"{trace.motion}: {trace.joint}, {rounded(1000 * trace.error)} {error}"
    label = label if len(label) <= 58 else f"{label[:57]}…"
    text = f"<text x='0' y='12' {FONT}>{escape(label)}</text>" if headed else ""
    text += (
        f"<text x='0' y='{TOP + 9}' {FONT}>{rounded(high)}</text>"
        f"<text x='0' y='{TOP + 22}' {FONT}>{position}</text>"
        f"<text x='0' y='{HEIGHT - BOTTOM}' {FONT}>{rounded(low)}</text>"
        f"<text x='{WIDTH - RIGHT}' y='{HEIGHT - 4}' text-anchor='end' {FONT}>{end:.1f} s</text>"
    )
    return _svg(HEIGHT, label, text + line(trace.command, "#8a94a6") + line(trace.measured, "#d97706"))


def data_uri(svg: str) -> str:
    """A picture as an address that holds it."""
    return f"data:image/svg+xml;base64,{b64encode(svg.encode()).decode()}"


def _svg(height: int, title: str, inner: str) -> str:
    space = "xmlns='http://www.w3.org/2000/svg'"
    return f"<svg {space} viewBox='0 0 {WIDTH} {height}' role='img'><title>{escape(title)}</title>{inner}</svg>"
