"""Texts of one motion, and what became of them."""

from dataclasses import dataclass, field

from bumblebee.errors import BadInput
from bumblebee.motion.captions import parse_caption

SLACK = 0.25
"""How far a range may end after its motion and is cut to it [s]: HumanML3D counts whole frames of 0.05 s, readers drop
a T-pose at the start, and people round to tenths."""
_LEAST = 0.002  # s, of a range: shorter ones would be written as none, which means the whole motion

BEYOND = "beyond its motion"
REVERSED = "ends before it starts"
UNREADABLE = "not a caption"
TWICE = "said twice"
ANOTHER_RATE = "the file's frame rate is not the index's"


@dataclass(frozen=True)
class Dropped:
    """A caption that is not used."""

    kind: str
    """One of the reasons above, to be counted."""
    line: str
    """The reason in one line, with the place that it was read from."""


@dataclass(frozen=True)
class Described:
    """The captions of one motion, and what else is known of them."""

    captions: tuple[str, ...] = ()
    """Lines of `Clip.captions`: `caption#tokens/POS#from#to`, seconds from its first frame; 0 and 0: all of it."""
    source: str = ""
    """Source of the captions, as in `Clip.caption_source`: "file", "csv", "humanml3d", "name", or ""."""
    notes: tuple[str, ...] = ()
    """One line each: captions that were dropped, a match that was not certain."""
    dropped: tuple[str, ...] = ()
    """The kind of reason for each caption that was dropped."""
    licence: str = ""
    """Licence of the texts, where it is known; the motion keeps its own."""
    used_rows: frozenset[int] = field(default_factory=frozenset)
    """Lines of the user's CSV that gave a caption."""
    dropped_rows: frozenset[int] = field(default_factory=frozenset)
    """Lines of the user's CSV that mean this motion and gave none."""
    passed_rows: frozenset[int] = field(default_factory=frozenset)
    """Lines of the user's CSV that mean this motion, whose text lies beside it."""


def fitted(line: str, where: object, duration: float) -> str | Dropped:
    """A caption whose range lies within its motion of `duration` [s], cut to it within `SLACK`; or why it does not."""
    try:
        parts = parse_caption(line, where)
    except BadInput as error:
        return Dropped(UNREADABLE, str(error))
    return f"{parts[0]}#{parts[1]}#0.0#0.0" if parts[2] == parts[3] == 0.0 else placed(*parts, where, duration)


def placed(text: str, tokens: str, since: float, until: float, where: object, duration: float) -> str | Dropped:
    """A caption from `since` to `until` [s], both of which are said, under the same conditions."""
    if until - since < _LEAST:
        return Dropped(REVERSED, str(BadInput(where, "a range that ends after it starts", f"{since:g} to {until:g} s")))
    if since > duration - _LEAST or until > duration + SLACK:
        came = f"{since:g} to {until:g} s"
        return Dropped(BEYOND, str(BadInput(where, f"a range within its motion of {duration:.2f} s", came)))
    return f"{text}#{tokens}#{since:.3f}#{min(until, duration):.3f}"


def sorted_out(found: list[str | Dropped]) -> tuple[tuple[str, ...], tuple[Dropped, ...]]:
    """Captions and what was dropped, apart."""
    kept = tuple(item for item in found if isinstance(item, str))
    return kept, tuple(item for item in found if isinstance(item, Dropped))
