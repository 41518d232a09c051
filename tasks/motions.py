"""Read or make the motions, resample them to 50 Hz, hold some out: the user's files -> data/motions."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.motion.pieces import held_out
from bumblebee.motion.reading.few_lines import said_of
from bumblebee.motion.reading.folder import ReadConfig, Reading, read_each, skipped_table
from bumblebee.motion.reading.walk import motion_sources
from bumblebee.motion.store import Library, LibraryWriter, read_index, write_library
from bumblebee.progress import progress
from bumblebee.ranges import Name, PartOf, Ranged, Unfit
from tasks.running import paths
from tasks.running.stage import load, log_run, output_folder, run_stage, scratch
from tasks.settings.watched import require_watched

EMBEDDED = "embedded"
CONTROL_HZ = 50.0
NOTES = "notes.csv"
TEXTS = ("captions_folder", "captions_csv", "humanml3d")
"""Settings of `motions.read.describe` that name files or folders."""
_FEW = 12  # lines of a kind on the terminal


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
    # Which motions are held out hangs on all of them, and memory does not hold them: they are written twice.
    unsplit = scratch("motions") / "unsplit"
    shutil.rmtree(unsplit, ignore_errors=True)  # of a run that was killed
    try:
        with LibraryWriter(unsplit) as writer:
            reading = gather(config, writer.add)
        write_split(Library(unsplit), config.holdout_share, reading)
    finally:
        shutil.rmtree(unsplit, ignore_errors=True)
    index = read_index(paths.MOTIONS)
    tell(index, reading)
    log_run("motions", params=config, metrics=metrics(index, reading))


def make_cache() -> None:
    """The folder of what is retargeted: an output of this stage that stays from run to run."""
    paths.RETARGETS.mkdir(parents=True, exist_ok=True)
    note = paths.RETARGETS / "README.md"
    if not note.exists():  # DVC warns of empty folders
        note.write_text("Retargeted motions, each by the hash of what it was made from (bumblebee/motion/cache.py).\n")


def gather(config: MotionsConfig, take: Callable[[Clip], None]) -> Reading:
    """Give `take` the clips of the configured source; what is said of its files."""
    if config.source == EMBEDDED:
        for clip in make_library(config.embedded):
            take(clip)
        return Reading([], skipped_table([]))
    source = Path(config.source).expanduser()
    if not source.exists():
        raise BadInput(
            "params.yaml: motions.source", f"a folder of motions or {EMBEDDED!r}", f"{source}: nothing there"
        )
    texts = config.read.describe
    named = {f"read.describe.{key}": getattr(texts, key) for key in TEXTS}
    require_watched("motions", {"source": source, "read.skeleton": config.read.skeleton, **named})
    files = sum(1 for _ in motion_sources(source))
    with progress(files, "reading motions", "files") as bar:
        return read_each(source, take, config.read, bar.update, paths.RETARGETS)


def write_split(library: Library, share: float, reading: Reading) -> None:
    """The library in its place, `share` of the motions held out, with what is said of the files beside it."""
    held = held_out(library.index.itertuples(index=False), share)
    with output_folder(paths.MOTIONS) as folder:
        clips = (replace(clip, split="test" if clip.name in held else "train") for clip in library)
        write_library(folder, clips, reading.skipped)
        reading.notes.to_csv(folder / NOTES, index=False)


def metrics(index: pd.DataFrame, reading: Reading) -> dict[str, float]:
    """Counts for MLflow."""
    texts = reading.texts.motions if reading.texts else {}
    return {
        "clips": len(index),
        "held_out": int((index["split"] == "test").sum()),
        "minutes": float(index["duration"].sum()) / 60,
        "files_skipped": len(reading.skipped),
        **{f"texts/{source}": float(count) for source, count in texts.items()},
    }


def tell(index: pd.DataFrame, reading: Reading) -> None:
    """Print what came: counts, sets with their licences, texts, why files were skipped, what was detected in others."""
    counts = metrics(index, reading)
    print(f"{counts['clips']} clips, {counts['minutes']:.1f} minutes, {counts['held_out']} held out -> {paths.MOTIONS}")
    sets = [f"  {row.set}: {row.clips} clips, {row.minutes:.1f} minutes, licence {row.licence}"
            for row in by_set(index).itertuples()]  # fmt: skip
    _print(sets, "  {} more sets: " + str(paths.MOTIONS / "index.parquet"))
    if reading.texts:
        print("motions with text: " + ", ".join(f"{name} {count}" for name, count in reading.texts.motions.items()))
        _print([f"text: {line}" for line in reading.texts.notes], "text: {} more lines like these")
    for what, table, column in (("skipped", reading.skipped, "reason"), ("noted", reading.notes, "note")):
        file = paths.MOTIONS / ("skipped.csv" if what == "skipped" else NOTES)
        told = said_of(what, zip(table["file"], table[column], strict=True))
        _print(told, f"{what}: {{}} more kinds: {file}")


def _print(lines: list[str], more: str) -> None:
    """The first lines, and how many more there are."""
    for line in lines[:_FEW]:
        print(line)
    if len(lines) > _FEW:
        print(more.format(len(lines) - _FEW))


def by_set(index: pd.DataFrame) -> pd.DataFrame:
    """Table of the source's folders, archives included: set, clips, minutes, licence."""
    table = pd.DataFrame({
        "set": [source.split("/")[0] for source in index["source"]],
        "minutes": index["duration"] / 60,
        "licence": index["licence"],
    })  # fmt: skip
    groups = table.groupby("set", sort=True)
    return groups.agg(clips=("minutes", "size"), minutes=("minutes", "sum"), licence=("licence", _all)).reset_index()


def _all(licences: pd.Series) -> str:
    return "; ".join(sorted(set(licences)))


if __name__ == "__main__":
    run_stage(main)
