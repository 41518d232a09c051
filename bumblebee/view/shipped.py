"""The policy that comes with BumbleBee, live on the embedded motions: no training, no files, no other server."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from bumblebee.deploy.policy import ExportedPolicy
from bumblebee.errors import BadInput
from bumblebee.learning.export import export_shipped
from bumblebee.learning.pretrained import SHIPPED
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import Kind, kinds
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
    if os.path.lexists(path):  # False for a name that the system refuses, too
        yield path
        return
    if str(path) not in SHIPPED:
        expected = f"a path, or a policy that comes along: {', '.join(SHIPPED)}"
        raise BadInput(path, expected, "no such file or folder", "docs/viewing.md says what can be seen.")
    with tempfile.TemporaryDirectory() as folder:
        yield export_shipped(Path(folder) / path, str(path))


def embedded_entries(policy: ExportedPolicy) -> list[Entry]:
    """The embedded motions, each made when it is chosen; a walk comes first."""
    order = sorted(kinds(), key=lambda kind: kind.name != _FIRST)
    return [Entry(kind.name, kind.family, kind.captions[0], _maker(policy, kind)) for kind in order]


def _maker(policy: ExportedPolicy, kind: Kind) -> Callable[[], Source]:
    return lambda: LivePolicy(policy, make(kind, 0, EmbeddedConfig()))
