"""Quality of sets of motions on the robot: `python -m benchmarks.retarget.quality FOLDER ... --out table.json`.

A set is a folder with motion files, one file, or a motion library. `NAME=FOLDER` names it in the table; a name that
ends in `:raw` has its folder read without our floor correction, one in `:lower` with the heights lowered alone.
"""

import argparse
import json
from pathlib import Path

from benchmarks.retarget.table import markdown, summary
from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.quality import quality
from bumblebee.motion.grounding import GroundingConfig, Method
from bumblebee.motion.reading.folder import ReadConfig, read_folder
from bumblebee.progress import progress

METHODS: dict[str, Method] = {":raw": "off", ":lower": "lower"}


def method_of(name: str) -> Method:
    """How the floor of a set of that name is corrected."""
    return next((method for ending, method in METHODS.items() if name.endswith(ending)), "refit")


def read_set(folder: Path, method: Method, fps: float) -> list[Clip]:
    """The whole motions of a folder, not cut into pieces."""
    config = ReadConfig(csv_fps=fps, max_seconds=0.0, grounding=GroundingConfig(method=method))
    return read_folder(folder, config).clips


def measured(name: str, clips: list[Clip]) -> dict[str, dict[str, float]]:
    """The measures of each motion of a set."""
    rows = {}
    with progress(len(clips), name, "motions") as bar:
        for clip in clips:
            rows[clip.name] = quality(clip)
            bar.update(1)
    return rows


def main() -> None:
    """Measure the sets named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sets", nargs="+", help="a folder, NAME=folder, NAME:raw=folder or NAME:lower=folder")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--csv-fps", type=float, default=60.0)
    options = parser.parse_args()
    tables = {}
    for given in options.sets:
        name, _, folder = given.rpartition("=")
        name = name or Path(folder).name
        clips = read_set(Path(folder), method_of(name), options.csv_fps)
        rows = measured(name, clips)
        tables[name] = {"motions": rows, "summary": summary(rows), "frames": sum(clip.frames for clip in clips)}
    options.out.write_text(json.dumps(tables, indent=1) + "\n")
    print(markdown({f"{name} ({len(t['motions'])})": t["summary"] for name, t in tables.items()}))


if __name__ == "__main__":
    main()
