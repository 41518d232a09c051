"""The shipped policy and the embedded motions."""

import tempfile
from pathlib import Path

from bumblebee.deploy.policy import ExportedPolicy
from bumblebee.learning.export import export_shipped
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import kinds


def shipped() -> ExportedPolicy:
    return ExportedPolicy.load(export_shipped(Path(tempfile.mkdtemp()) / "shipped"))


def clips(names: list[str]) -> list[Clip]:
    return [make(kind, 0, EmbeddedConfig()) for kind in kinds() if not names or kind.name in names]
