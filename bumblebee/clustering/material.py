"""Features that the clustering keeps of a clip once its frames are read: some 15 kB, so that thousands fit."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.features import motion_windows, window_times
from bumblebee.clustering.poses import poses
from bumblebee.clustering.statistics import clip_statistics
from bumblebee.clustering.text import evidence, plain_text
from bumblebee.motion.clip import Clip
from bumblebee.motion.contacts import foot_contacts
from bumblebee.motion.describe.windows import captions_in


@dataclass(frozen=True, eq=False)
class Material:
    """One clip's features, numbers and texts.

    `windows`: (T, D) float32 each, in the order of `features.COLUMNS`. `texts`: for each window the plain captions that
    describe it. `evidence`: likewise, those alone that somebody wrote about the motion. `statistics`: numbers of table
    2. `poses` (P, 15, 2): a few poses [m], see `poses.poses`.
    """

    name: str
    split: str
    family: str
    licence: str
    caption_source: str
    seconds: float
    windows: tuple[np.ndarray, ...]
    texts: tuple[tuple[str, ...], ...]
    evidence: tuple[tuple[str, ...], ...]
    statistics: dict[str, float]
    poses: np.ndarray

    @property
    def held_out(self) -> bool:
        """Whether no policy, and no clustering, learns from it."""
        return self.split == "test"

    @property
    def captions(self) -> tuple[str, ...]:
        """The distinct captions of all windows, in the order of the windows."""
        return tuple(dict.fromkeys(text for texts in self.texts for text in texts))

    @property
    def source(self) -> str:
        """Where the captions come from: "file", "humanml3d", "csv", "made", "name", "none" or "unknown"."""
        return (self.caption_source or "unknown") if self.captions else "none"

    @property
    def written(self) -> tuple[str, ...]:
        """The distinct captions that are evidence of what the motion means."""
        return tuple(dict.fromkeys(text for texts in self.evidence for text in texts))


def gather(clips: Iterable[Clip], config: ClusterConfig) -> list[Material]:
    """The material of clips that are read one after the other."""
    return [material_of(clip, config) for clip in clips]


def material_of(clip: Clip, config: ClusterConfig) -> Material:
    """Features at `config.fps` in windows of `config.window_seconds`, each with the captions that describe it."""
    contacts = foot_contacts(clip)
    times = window_times(clip, config.fps, config.window_seconds)
    texts = [_plain(describing(clip.captions, *time)) for time in times]
    return Material(
        name=clip.name,
        split=clip.split,
        family=clip.family,
        licence=clip.licence,
        caption_source=clip.caption_source,
        seconds=clip.duration,
        windows=tuple(motion_windows(clip, config.fps, config.window_seconds, contacts)),
        texts=tuple(texts),
        evidence=tuple(evidence(own, clip.caption_source, clip.name) for own in texts),
        statistics=clip_statistics(clip, contacts),
        poses=poses(clip),
    )


def describing(captions: Sequence[str], start: float, end: float) -> tuple[str, ...]:
    """The captions that describe the time from `start` to `end` [s]; a plain sentence describes all of the clip."""
    lines = [caption if caption.count("#") == 3 else f"{plain_text(caption)}##0#0" for caption in captions]
    return captions_in([line for line in lines if plain_text(line)], start, end)


def _plain(captions: Sequence[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(text for text in map(plain_text, captions) if text))
