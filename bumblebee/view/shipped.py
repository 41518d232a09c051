"""The policy that comes with BumbleBee, live on the embedded motions: no training, no files, no other server."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from bumblebee.learning.export import export_shipped
from bumblebee.learning.pretrained import require_seen
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import Kind, kinds
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.view.live import LivePolicy
from bumblebee.view.sources import Entry, Source

_FIRST = "walk"


@contextmanager
def shipped_policy() -> Iterator[ExportedPolicy]:
    """The shipped policy as it is deployed, from a folder that is gone afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        yield ExportedPolicy.load(export_shipped(Path(folder) / "policy"))


@contextmanager
def at_hand(path: Path) -> Iterator[Path]:
    """The path, or for the name of a policy that comes along its folder as it is deployed, which is gone afterwards.

    Raises:
        BadInput: nothing lies there, and no policy has the name.
    """
    require_seen(path)
    if os.path.lexists(path):
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        yield export_shipped(Path(folder) / path, str(path))


def embedded_entries(policy: ExportedPolicy) -> list[Entry]:
    """The embedded motions, each made when it is chosen; a walk comes first."""
    order = sorted(kinds(), key=lambda kind: kind.name != _FIRST)
    return [Entry(kind.name, kind.family, kind.captions[0], _maker(policy, kind)) for kind in order]


def _maker(policy: ExportedPolicy, kind: Kind) -> Callable[[], Source]:
    return lambda: LivePolicy(policy, make(kind, 0, EmbeddedConfig()))
