"""The motion library that needs no data: clips of everyday motions that the G1 can do, made by this code.

It stands in for the text-described motion library (paper, section 3.1: AMASS with HumanML3D's captions) in smoke
runs, tests and the demonstration; a real library is read by the other modules of `bumblebee.motion`.
"""

import hashlib
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded.captions import caption_line
from bumblebee.motion.embedded.kinds import FAMILIES, Kind, kinds
from bumblebee.motion.embedded.plan import FPS
from bumblebee.motion.embedded.solver import solve
from bumblebee.motion.embedded.vary import Vary
from bumblebee.motion.kinematics import make_clip
from bumblebee.ranges import Count, Name, Range, Ranged, Seed, Size

__all__ = ["FAMILIES", "EmbeddedConfig", "make_library"]

SOURCE, LICENCE = "made by bumblebee.motion.embedded", "Apache-2.0"


@dataclass(frozen=True)
class EmbeddedConfig(Ranged):
    """Which clips are made; the same configuration makes the same bytes."""

    seed: Seed = 0
    """Sizes and tempi of every clip."""
    families: Annotated[tuple[Name, ...], Size()] = FAMILIES
    """Families to make."""
    limit: Count | None = None
    """At most so many clips, taken in turn from each family; None for all."""
    variants: Annotated[tuple[Annotated[int, Range(least=0, most=999)], ...], Size()] = (0,)
    """Versions of every kind, other sizes and tempi each; 0 has the plain name, 3 ends in "_v3"."""
    variation: Annotated[float, Range(least=0, most=0.5)] = 0.06
    """Share by which sizes and tempi vary."""

    def __post_init__(self) -> None:
        """Refuse families that there are not, and what would make a clip twice."""
        super().__post_init__()
        self.require_names("families", FAMILIES)
        self.require(len(set(self.variants)) == len(self.variants), "variants", "distinct numbers")


def make_library(config: EmbeddedConfig | None = None) -> list[Clip]:
    """The clips, family by family; deterministic."""
    config = config or EmbeddedConfig()
    return [make(kind, variant, config) for kind, variant in _chosen(config)]


def make(kind: Kind, variant: int, config: EmbeddedConfig) -> Clip:
    """One clip."""
    qpos = solve(kind.build(Vary(config.seed, variant, kind.name, config.variation)))
    clip = make_clip(
        kind.name if variant == 0 else f"{kind.name}_v{variant}",
        FPS,
        qpos[:, :3],
        qpos[:, 3:7],
        qpos[:, 7:],
        captions=tuple(caption_line(text) for text in kind.captions),
        source=SOURCE,
        licence=LICENCE,
        family=kind.family,
        caption_source="made",
    )
    digest = hashlib.sha256()
    for array in (clip.root_pos, clip.root_quat, clip.joint_pos):
        digest.update(np.ascontiguousarray(array).tobytes())
    return replace(clip, sha256=digest.hexdigest())


def _chosen(config: EmbeddedConfig) -> list[tuple[Kind, int]]:
    """The kinds and variants of a configuration; a limit takes one of each family, then another of each, and so on."""
    every = [(kind, variant) for kind in kinds() if kind.family in config.families for variant in config.variants]
    rank: dict[str, int] = {}
    order = []
    for index, (kind, _) in enumerate(every):
        rank[kind.family] = rank.get(kind.family, 0) + 1
        order.append((rank[kind.family], index))
    kept = sorted(order)[: config.limit]
    return [every[index] for index in sorted(index for _, index in kept)]
