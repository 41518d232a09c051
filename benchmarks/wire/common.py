"""The shipped policy and the embedded motions."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from bumblebee.learning.export import export_shipped
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import kinds
from bumblebee.policy.exported import ExportedPolicy


def shipped() -> ExportedPolicy:
    return ExportedPolicy.load(export_shipped(Path(tempfile.mkdtemp()) / "shipped"))


def clips(names: list[str]) -> list[Clip]:
    return [make(kind, 0, EmbeddedConfig()) for kind in kinds() if not names or kind.name in names]


def lasting(seconds: float) -> Clip:
    """A clip of about so long that begins and ends in the relaxed stand."""
    (clip,) = clips(["arm_circles"])
    arrays = ("root_pos", "root_quat", "joint_pos", "key_pos")
    times = max(1, round(seconds / clip.duration))
    return replace(clip, **{name: np.concatenate([getattr(clip, name)] * times) for name in arrays})
