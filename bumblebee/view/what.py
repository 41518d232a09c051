"""Tell what lies at a path, and how it is shown: motions, a policy, an evaluation, or measured rollouts."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.learning.trial_folder import ENDS, FOLLOWED, KeptRollout, is_kept, read_kept
from bumblebee.motion.clip import Clip
from bumblebee.motion.formats.convert import clips_at
from bumblebee.motion.reading.few_lines import said_of
from bumblebee.motion.reading.nothing import nothing
from bumblebee.motion.reading.one_file import FileConfig
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import CONTROL_HZ
from bumblebee.report.replays.replay import Drawn, side_by_side
from bumblebee.robot.facts import joint_names
from bumblebee.view.live import LivePolicy
from bumblebee.view.shipped import embedded_entries
from bumblebee.view.sources import REFERENCE, Entry, Recorded, Source, of_clip


def is_policy(path: Path) -> bool:
    """Whether a folder is an exported policy."""
    return (path / "contract.json").is_file()


def is_dataset(path: Path) -> bool:
    """Whether a folder holds measured rollouts."""
    return (path / "rollouts").is_dir()


def evaluation_entries(path: Path) -> list[Entry]:
    """Rollouts of an evaluation, those that fell first, then those of which a part was off.

    Raises:
        BadInput: an evaluation without states.
    """
    if not is_kept(path):
        remedy = "`bumblebee evaluate POLICY MOTIONS --states FOLDER`, then `bumblebee view FOLDER`."
        raise BadInput(path, "an evaluation with the robot's states", "one without", remedy)
    rollouts = sorted(read_kept(path), key=lambda kept: (ENDS.index(kept.ended), kept.share, kept.name))
    return [Entry(kept.name, kept.ended, kept.family, partial(_kept, kept)) for kept in rollouts]


def is_evaluation(path: Path) -> bool:
    """Whether a folder is an evaluation: by `bumblebee evaluate`, or by the loop, which keeps no states."""
    return is_kept(path) or (path / "episodes.parquet").is_file()


def _kept(kept: KeptRollout) -> Recorded:
    seconds = len(kept.robot) / kept.fps
    lost = "" if kept.ended == FOLLOWED else f", after {100 * kept.share:.0f} % of the motion"
    curves = {name: [kept.robot[:, 7 + j], kept.motion[:, 7 + j]] for j, name in enumerate(joint_names())}
    note = f"{kept.ended}{lost}; {seconds:.1f} s shown"
    states = side_by_side([kept.robot, kept.motion])
    return Recorded(states, kept.fps, (Drawn("robot"), REFERENCE), note, curves, ("robot", "reference"))


def motion_entries(path: Path, files: FileConfig, say: Callable[[str], None]) -> list[Entry]:
    """The motions of a file or folder, as they are; `say` gets the lines about files that are skipped.

    Raises:
        BadInput: none can be used.
    """
    return [_of(clip, partial(of_clip, clip, joint_names())) for clip in _clips(path, files, say)]


def policy_entries(path: Path, motions: Path | None, files: FileConfig, say: Callable[[str], None]) -> list[Entry]:
    """A policy live on a file or folder of motions; without one, on the embedded motions.

    Raises:
        BadInput: a policy that cannot run, or no motion that can be used.
    """
    policy = ExportedPolicy.load(path)
    if motions is None:
        return embedded_entries(policy)
    return [_of(clip, partial(LivePolicy, policy, clip)) for clip in _clips(motions, files, say, CONTROL_HZ)]


def _of(clip: Clip, make: Callable[[], Source]) -> Entry:
    return Entry(clip.name, clip.family, clip.captions[0].split("#")[0] if clip.captions else "", make)


def _clips(path: Path, files: FileConfig, say: Callable[[str], None], fps: float | None = None) -> list[Clip]:
    skipped: list[tuple[str, str]] = []
    clips = [clip for clip, _ in clips_at(path, files, lambda *said: skipped.append(said), fps)]
    if not clips:
        remedy = f"`bumblebee motions inspect {path}` lists each file with its reason."
        raise nothing(path, "a motion of the robot", skipped, remedy)
    for line in said_of("skipped", skipped):
        say(line)
    return clips
