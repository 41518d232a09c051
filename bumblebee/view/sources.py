"""Something that can be shown: frame by frame, at its own rate, from any of its frames."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip, clip_states
from bumblebee.report.replays.replay import GHOST, Drawn

REFERENCE = Drawn("reference", GHOST)
"""The motion that a policy follows."""
MOTION = Drawn("motion")
"""A motion alone."""


class Source(Protocol):
    """Frames that the page plays."""

    fps: float
    """Frames a second at real speed."""
    robots: Sequence[Drawn]
    """Robots of the picture, in the order of `qpos`."""
    curves: Mapping[str, Sequence[np.ndarray]]
    """Name of a signal -> (frames,) values of each robot that is in `lines`; empty where there is nothing to plot."""
    lines: Sequence[str]
    """Names of the lines in each plot."""

    @property
    def frames(self) -> int:
        """Number of frames."""

    def seek(self, frame: int) -> None:
        """Go to a frame."""

    def advance(self) -> int:
        """Go on by one frame and return its number; the last is followed by the first."""

    def qpos(self) -> np.ndarray:
        """State of the whole picture now."""

    def said(self) -> str:
        """One line about what is shown now."""


@dataclass
class Recorded:
    """States that lie ready."""

    states: np.ndarray
    """(F, nq) of the whole picture."""
    fps: float
    robots: Sequence[Drawn]
    note: str = ""
    curves: Mapping[str, Sequence[np.ndarray]] = field(default_factory=dict)
    lines: Sequence[str] = ()
    _at: int = 0

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.states)

    def seek(self, frame: int) -> None:
        """Go to a frame."""
        self._at = min(max(frame, 0), self.frames - 1)

    def advance(self) -> int:
        """Go on by one frame, from the last to the first."""
        self._at = (self._at + 1) % self.frames
        return self._at

    def qpos(self) -> np.ndarray:
        """State of the whole picture now."""
        return self.states[self._at]

    def said(self) -> str:
        """The note."""
        return self.note


@dataclass(frozen=True)
class Entry:
    """One thing to choose in the page."""

    name: str
    group: str = ""
    """Family of a motion, or how an episode ended."""
    text: str = ""
    """Caption, or a sentence."""
    make: Callable[[], Source] = None  # type: ignore[assignment]
    """Reads or makes it, when it is chosen."""


def found(entries: Sequence[Entry], words: str) -> list[Entry]:
    """Entries whose name, group and text hold every one of the words, in any case."""
    wanted = words.lower().split()
    return [e for e in entries if all(word in f"{e.name} {e.group} {e.text}".lower() for word in wanted)]


def named(entries: Sequence[Entry], name: str, where: object) -> Entry:
    """The entry of a name; without one, the first.

    Raises:
        BadInput: no entry has the name.
    """
    chosen = [entry for entry in entries if name in ("", entry.name)]
    if not chosen:
        some = ", ".join(entry.name for entry in entries[:8])
        raise BadInput(where, f"something called {name!r}", f"{len(entries)} others: {some}", "Name one with --name.")
    return chosen[0]


def of_clip(clip: Clip, joints: Sequence[str]) -> Recorded:
    """A motion as it is in its file; curves of the joints [rad]."""
    lines = dict(zip(joints, ([column] for column in clip.joint_pos.T), strict=True))
    captions = "; ".join(text.split("#")[0] for text in clip.captions[:2])
    return Recorded(clip_states(clip), clip.fps, (MOTION,), captions, lines, ("motion",))
