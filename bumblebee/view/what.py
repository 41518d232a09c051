"""Tell what lies at a path, and how it is shown: motions, a policy, or measured rollouts."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from bumblebee.deploy.policy import ExportedPolicy
from bumblebee.deploy.robots import CONTROL_HZ
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.convert import clips_at
from bumblebee.motion.one_file import FileConfig
from bumblebee.robot.facts import joint_names
from bumblebee.view.live import LivePolicy
from bumblebee.view.shipped import embedded_entries
from bumblebee.view.sources import Entry, Source, of_clip


def is_policy(path: Path) -> bool:
    """Whether a folder is an exported policy."""
    return (path / "contract.json").is_file()


def is_dataset(path: Path) -> bool:
    """Whether a folder holds measured rollouts."""
    return (path / "rollouts").is_dir()


def motion_entries(path: Path, files: FileConfig) -> list[Entry]:
    """The motions of a file or folder, as they are.

    Raises:
        BadInput: none can be used.
    """
    return [_of(clip, partial(of_clip, clip, joint_names())) for clip in _clips(path, files)]


def policy_entries(path: Path, motions: Path | None, files: FileConfig) -> list[Entry]:
    """A policy live on a file or folder of motions; without one, on the embedded motions.

    Raises:
        BadInput: a policy that cannot run, or no motion that can be used.
    """
    policy = ExportedPolicy.load(path)
    if motions is None:
        return embedded_entries(policy)
    return [_of(clip, partial(LivePolicy, policy, clip)) for clip in _clips(motions, files, CONTROL_HZ)]


def _of(clip: Clip, make: Callable[[], Source]) -> Entry:
    return Entry(clip.name, clip.family, clip.captions[0].split("#")[0] if clip.captions else "", make)


def _clips(path: Path, files: FileConfig, fps: float | None = None) -> list[Clip]:
    reasons: list[str] = []
    clips = [clip for clip, _ in clips_at(path, files, reasons.append, fps)]
    if not clips:
        came = f"none that can be used; the first: {reasons[0]}" if reasons else "none"
        remedy = f"`bumblebee motions inspect {path}` lists each file with its reason."
        raise BadInput(path, "a motion of the robot", came[:1500], remedy)
    return clips
