"""Read or make the motions, resample them to 50 Hz, hold some out: the user's files -> data/motions."""

from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.motion.folder import ReadConfig, Reading, read_folder, skipped_table
from bumblebee.motion.pieces import hold_out
from bumblebee.motion.store import write_library
from bumblebee.motion.walk import motion_sources
from bumblebee.progress import progress
from bumblebee.ranges import Name, PartOf, Ranged, Unfit
from tasks import paths
from tasks.stage import load, log_run, run_stage
from tasks.watched import require_watched

EMBEDDED = "embedded"
CONTROL_HZ = 50.0
NOTES = "notes.csv"
TEXTS = ("captions_folder", "captions_csv", "humanml3d")
"""Settings of `motions.read.describe` that name files or folders."""
_FEW = 20  # lines of a kind on the terminal


@dataclass(frozen=True)
class MotionsConfig(Ranged):
    """Where the motions come from."""

    source: Name = EMBEDDED
    """"embedded" for the library that comes with BumbleBee, or a folder (or one file) of motions."""
    holdout_share: PartOf = 0.15
    """Share of the motions that no policy trains on, by a hash of their names, in each family of 4 or more."""
    embedded: EmbeddedConfig = field(default_factory=EmbeddedConfig)
    """Which clips the embedded library has."""
    read: ReadConfig = field(default_factory=ReadConfig)
    """How the files of a folder are read."""

    def __post_init__(self) -> None:
        """Refuse clips at another rate than the robot's control."""
        super().__post_init__()
        if self.read.fps != CONTROL_HZ:
            raise Unfit(type(self), "read.fps", f"{CONTROL_HZ:g}, the rate of the policies", self.read.fps)


def main() -> None:
    """Read the source, split it, write the library, say what came."""
    config = load("motions", MotionsConfig)
    make_cache()
    reading = gather(config)
    clips = hold_out(reading.clips, config.holdout_share)
    write_library(paths.MOTIONS, clips, reading.skipped)
    reading.notes.to_csv(paths.MOTIONS / NOTES, index=False)
    tell(clips, reading)
    tables = [paths.MOTIONS / "skipped.csv", paths.MOTIONS / NOTES]
    log_run("motions", params=config, metrics=metrics(clips, reading), artifacts=tables)


def make_cache() -> None:
    """The folder of what is retargeted: an output of this stage that stays from run to run."""
    paths.RETARGETS.mkdir(parents=True, exist_ok=True)
    note = paths.RETARGETS / "README.md"
    if not note.exists():  # DVC warns of empty folders
        note.write_text("Retargeted motions, each by the hash of what it was made from (bumblebee/motion/cache.py).\n")


def gather(config: MotionsConfig) -> Reading:
    """The clips of the configured source, and the files that gave none."""
    if config.source == EMBEDDED:
        return Reading(make_library(config.embedded), skipped_table([]))
    source = Path(config.source).expanduser()
    if not source.exists():
        raise BadInput(
            "params.yaml: motions.source", f"a folder of motions or {EMBEDDED!r}", f"{source}: nothing there"
        )
    texts = config.read.describe
    named = {f"read.describe.{key}": getattr(texts, key) for key in TEXTS}
    require_watched("motions", {"source": source, **named})
    files = sum(1 for _ in motion_sources(source))
    with progress(files, "reading motions", "files") as bar:
        return read_folder(source, config.read, bar.update, paths.RETARGETS)


def metrics(clips: list[Clip], reading: Reading) -> dict[str, float]:
    """Counts for MLflow."""
    texts = (
        {f"texts/{source}": float(count) for source, count in reading.texts.motions.items()} if reading.texts else {}
    )
    return {
        "clips": len(clips),
        "held_out": sum(clip.split == "test" for clip in clips),
        "minutes": sum(clip.duration for clip in clips) / 60,
        "files_skipped": len(reading.skipped),
        **texts,
    }


def tell(clips: list[Clip], reading: Reading) -> None:
    """One line of counts, and one for each reason why files were skipped."""
    counts = metrics(clips, reading)
    print(f"{counts['clips']} clips, {counts['minutes']:.1f} minutes, {counts['held_out']} held out -> {paths.MOTIONS}")
    for row in by_set(clips).itertuples():
        print(f"  {row.set}: {row.clips} clips, {row.minutes:.1f} minutes, licence {row.licence}")
    if reading.texts:
        print("motions with text: " + ", ".join(f"{name} {count}" for name, count in reading.texts.motions.items()))
        for line in reading.texts.notes[:_FEW]:
            print(f"text: {line}")
    for what, table, column in (("skipped", reading.skipped, "reason"), ("noted", reading.notes, "note")):
        for said, group in table.groupby(column, sort=False):
            others = group["file"].nunique() - 1
            print(f"{what} {group['file'].iloc[0]}{f' and {others} more' if others else ''}: {said}")


def by_set(clips: list[Clip]) -> pd.DataFrame:
    """What each folder or archive of the source gave: set, clips, minutes, licence."""
    rows = [(clip.source.split("/")[0], clip.duration / 60, clip.licence) for clip in clips]
    table = pd.DataFrame(rows, columns=["set", "minutes", "licence"])
    groups = table.groupby("set", sort=True)
    return groups.agg(clips=("minutes", "size"), minutes=("minutes", "sum"), licence=("licence", _all)).reset_index()


def _all(licences: pd.Series) -> str:
    return "; ".join(sorted(set(licences)))


if __name__ == "__main__":
    run_stage(main)
