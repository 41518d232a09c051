"""Which captions describe a window of a motion: what the autoencoder may pair with that window when it trains."""

from collections.abc import Sequence

from bumblebee.motion.captions import parse_caption

LEAST_OVERLAP = 0.5
"""Share of the shorter of caption and window that both must share.

With less, a window shows more of something else than of what the caption says, or lacks most of it: a pair that
teaches the wrong word. With more, a caption that the cut between two windows halves would go to neither. Of the
shorter, so that "kicks" (1 s) describes the 8 s in which the kick lies, and "walks in a circle" (40 s) each 8 s of it.
"""


def captions_in(
    captions: Sequence[str], start: float, end: float, least_overlap: float = LEAST_OVERLAP
) -> tuple[str, ...]:
    """The captions that describe the window from `start` to `end` [s] of a clip, as they are and in their order.

    A caption of the whole motion (`#0#0`) describes every window.

    Args:
        captions: lines of `Clip.captions`; their times count from the clip's first frame [s].
        start: of the window [s].
        end: of the window, not before `start` [s].
        least_overlap: share of the shorter of both that they must have in common.
    """
    return tuple(line for line in captions if _describes(*parse_caption(line)[2:], start, end, least_overlap))


def within(captions: Sequence[str], start: float, end: float) -> tuple[str, ...]:
    """The captions of a motion that describe its part from `start` to `end` [s], times counted from `start`.

    By the same rule as `captions_in`: a caption that the part has only the end of would say of it what is not there.
    """
    moved = (_moved(line, start, end) for line in captions_in(captions, start, end))
    return tuple(line for line in moved if line)


def _moved(line: str, start: float, end: float) -> str:
    text, tokens, since, until = parse_caption(line)
    if since == until == 0.0:
        return line
    ends = f"{min(until, end) - start:.3f}"
    # A moment at the part's very start would read as the whole of it.
    return "" if float(ends) == 0.0 else f"{text}#{tokens}#{max(since - start, 0.0):.3f}#{ends}"


def _describes(since: float, until: float, start: float, end: float, least: float) -> bool:
    if since == until == 0.0:
        return True
    common = min(until, end) - max(since, start)
    return common >= 0 and common >= least * min(until - since, end - start)
