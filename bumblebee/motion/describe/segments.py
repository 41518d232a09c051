"""Times of HumanML3D on the motion that it cut its segments from."""

from dataclasses import dataclass

from bumblebee.errors import BadInput
from bumblebee.motion.captions import parse_caption
from bumblebee.motion.describe.described import BEYOND, REVERSED, UNREADABLE, Dropped, placed

INDEX_FPS = 20
"""Frames a second of HumanML3D's index."""


@dataclass(frozen=True)
class Segment:
    """A part of a motion that HumanML3D has texts for: the frames [start, end) at `INDEX_FPS`; end None: to its end."""

    name: str
    start: int
    end: int | None


@dataclass(frozen=True)
class Span:
    """Span of a caption on the motion: from `since` to `until` [s]; `stretch` seconds of it for one of HumanML3D's."""

    since: float
    until: float
    stretch: float = 1.0


def index_rate(amass_fps: float | None) -> float:
    """Frames a second that an index frame really is, for a motion of AMASS recorded at `amass_fps`.

    HumanML3D takes every n-th frame with n = floor(rate / 20), so that 59.94 Hz becomes 29.97 and 150 Hz 21.4; 20 for
    the rates that most have, and where the rate is not known.
    """
    return INDEX_FPS if amass_fps is None or amass_fps < INDEX_FPS else amass_fps / int(amass_fps / INDEX_FPS)


def span_of(segment: Segment, cut: int, rate: float, duration: float) -> Span:
    """Where a segment lies on its motion.

    Args:
        segment: of the index.
        cut: frames that were cut from the motion's start before the index counts.
        rate: of the index's frames [Hz].
        duration: of the motion [s].
    """
    until = duration if segment.end is None else (cut + segment.end) / rate
    return Span((cut + segment.start) / rate, until, INDEX_FPS / rate)


def on_motion(line: str, where: object, span: Span, duration: float) -> str | Dropped:
    """A line of a segment's text with its times on the motion, or why there is none.

    Times in the line count from the segment's start; none (0 and 0, or nan) mean all of it. Annotators saw the segment
    alone: a time past its end (41 of 43,692 lines) means its end, as it does to HumanML3D's own loader.
    """
    try:
        text, tokens, since, until = parse_caption(line, where)
    except BadInput as error:
        return Dropped(UNREADABLE, str(error))
    length = span.until - span.since
    if since == until == 0.0:
        since, until = 0.0, length
    elif since >= until:
        return Dropped(REVERSED, str(BadInput(where, "a range that ends after it starts", f"{since:g} to {until:g} s")))
    else:
        since, until = since * span.stretch, min(until * span.stretch, length)
    if since >= until:
        came = f"from {since:g} s, of a segment from {span.since:g} to {span.until:g} s"
        return Dropped(BEYOND, str(BadInput(where, f"a range within its motion of {duration:.2f} s", came)))
    return placed(text, tokens, span.since + since, span.since + until, where, duration)
