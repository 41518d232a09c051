"""How long, how large, how much memory: a library of generated motions of 8 s in one file each, and in shards.

    python -m benchmarks.motion_store 1000 8179 [--folder FOLDER] [--single-most 8179] [--json out.json]

Each step runs in a process of its own, whose peak memory is counted, the two layouts after each other; the files are in
the machine's page cache, as after writing. Motions are sums of sinusoids with the noise of a capture, 400 frames; the
arrays of 64 of them are used again and again, so that making them costs nothing: no layout packs across motions.
"""

import argparse
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.store import (
    Library,
    LibraryWriter,
    index_of,
    map_clips,
    read_clip,
    write_clip,
    write_library,
)
from bumblebee.robot.facts import stand_pose

FPS, FRAMES, KINDS = 50.0, 400, 64
SHARE = 0.01  # appended, of the motions
RANDOM = 200  # motions read by name
LAYOUTS = ("single", "shards")
STEPS = ("write", "open", "iterate", "random", "append", "change", "hash", "hash_again")


@cache
def motion(seed: int) -> Clip:
    """A motion of 8 s."""
    rng = np.random.default_rng(seed)
    time_ = np.arange(FRAMES)[:, None] / FPS
    joints = np.tile(stand_pose(), (FRAMES, 1)) + rng.normal(0, 1e-4, (FRAMES, 23))
    for _ in range(6):
        rate, size, phase = rng.uniform(0.2, 3, 23), rng.normal(0, 0.1, 23), rng.uniform(0, 2 * np.pi, 23)
        joints += size / (1 + rate) * np.sin(2 * np.pi * rate * time_ + phase)
    half = (rng.uniform(-3, 3) + 0.3 * np.sin(time_)) / 2
    quat = np.concatenate([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    root = np.concatenate([0.5 * time_, 0.2 * np.sin(time_), 0.78 + 0.02 * np.sin(3 * time_)], axis=1)
    return make_clip("m", FPS, root + rng.normal(0, 1e-4, root.shape), quat, joints)


def motions(start: int, stop: int) -> Iterator[Clip]:
    """Motions by number, with the facts that real ones have."""
    about = {
        "captions": ("a person walks forward and turns.#a/DET person/NOUN walk/VERB#0.0#0.0",) * 3,
        "licence": "CC BY 4.0",
        "family": "walk",
        "caption_source": "file",
    }
    for number in range(start, stop):
        name = f"set{number % 7}_subject{number % 50:02d}_walk_{number:06d}"
        source = f"set/{name}.npz"
        yield replace(motion(number % KINDS), name=name, source=source, sha256=f"{number:064x}", **about)


def write_single(folder: Path, clips: Iterator[Clip]) -> None:
    """A library as it was before shards."""
    (folder / "clips").mkdir(parents=True)
    facts = []
    for clip in clips:
        write_clip(folder / "clips" / f"{clip.name}.parquet", clip)
        facts.append(index_of([clip]).iloc[0].to_dict())
    _index_single(folder, facts)


def add_single(folder: Path, clips: Iterator[Clip]) -> None:
    """Add motions to the library: their files, and the index anew."""
    facts = Library(folder).index.to_dict("records")
    for clip in clips:
        write_clip(folder / "clips" / f"{clip.name}.parquet", clip)
        facts.append(index_of([clip]).iloc[0].to_dict())
    _index_single(folder, facts)


def _index_single(folder: Path, facts: list[dict[str, Any]]) -> None:
    pd.DataFrame(facts).to_parquet(folder / "index.parquet", index=False)


def add_shards(folder: Path, clips: Iterator[Clip]) -> None:
    """More motions, or others of the same names."""
    with LibraryWriter(folder) as writer:
        for clip in clips:
            writer.add(clip)


def duration(clip: Clip) -> float:
    """A work that costs nothing: what is left is the reading."""
    return clip.duration


def step(layout: str, name: str, folder: Path, count: int) -> None:
    """One step; `hash` is what `dvc add` does, without copying."""
    single = layout == "single"
    works: dict[str, Callable[[], object]] = {
        "write": lambda: (write_single if single else write_library)(folder, motions(0, count)),
        "open": lambda: Library(folder),
        "iterate": lambda: sum(clip.frames for clip in Library(folder)),
        "two_processes": lambda: sum(map_clips(folder, duration, processes=2)),
        "random": lambda: _random(folder, single),
        "append": lambda: (add_single if single else add_shards)(
            folder, motions(count, count + max(1, int(count * SHARE)))
        ),
        "change": lambda: _change(folder, single),
        "hash": lambda: dvc_hash(folder),
        "hash_again": lambda: dvc_hash(folder),
    }
    works[name]()


def _random(folder: Path, single: bool) -> None:
    library = Library(folder)
    for name in np.random.default_rng(0).choice(library.names, min(RANDOM, len(library)), replace=False):
        _ = read_clip(folder / "clips" / f"{name}.parquet") if single else library[str(name)]


def _change(folder: Path, single: bool) -> None:
    """One motion is another one now."""
    (clip,) = motions(3, 4)
    changed = replace(clip, sha256="f" * 64)
    if not single:
        add_shards(folder, iter([changed]))
        return
    write_clip(folder / "clips" / f"{clip.name}.parquet", changed)
    facts = Library(folder).index
    facts.loc[facts["name"] == clip.name, "sha256"] = changed.sha256
    facts.to_parquet(folder / "index.parquet", index=False)


def dvc_hash(folder: Path) -> str:
    """The folder's hash as DVC makes it, with its own memory of files that did not change."""
    from dvc.repo import Repo
    from dvc_data.hashfile.build import build

    with Repo(str(folder.parent)) as repo:
        _, _, found = build(repo.cache.local, str(folder), repo.cache.local.fs, "md5")
        return str(found.hash_info.value)


def run(layout: str, name: str, folder: Path, count: int) -> dict[str, float]:
    """A step in a process of its own: seconds without the imports, and the peak of its memory [MB]."""
    command = [sys.executable, "-m", "benchmarks.motion_store", "--step", layout, name, str(folder), str(count)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BadInput(" ".join(command[2:]), "a step that works", done.stderr.strip()[-300:] or "nothing said")
    return json.loads(done.stdout.splitlines()[-1])


def measure(count: int, root: Path, layouts: Sequence[str]) -> list[dict[str, Any]]:
    """All steps for so many motions, the layouts in turn."""
    rows = []
    for layout in layouts:
        (root / layout / ".dvc").mkdir(parents=True)
        subprocess.run([sys.executable, "-m", "dvc", "init", "-q", "--no-scm", "-f"], cwd=root / layout, check=True)
    for name in (*STEPS[:3], "two_processes", *STEPS[3:]):
        for layout in layouts:
            folder = root / layout / "lib"
            found = run(layout, name, folder, count)
            if name == "write":
                files = [path for path in folder.rglob("*") if path.is_file()]
                found |= {"disk_mb": sum(path.stat().st_size for path in files) / 1e6, "files": len(files)}
            rows.append({"motions": count, "step": name, "layout": layout, **found})
            print(json.dumps(rows[-1]), flush=True)
    return rows


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Markdown: a line for each step and number of motions, the layouts side by side."""
    heads = [f"{layout}: {what}" for layout in ("one file each", "shards") for what in ("s", "CPU s", "peak MB")]
    lines = [f"| motions | step | {' | '.join(heads)} | ratio of CPU s |", "|---|---|" + "---|" * 7]
    by = {(row["motions"], row["step"], row["layout"]): row for row in rows}
    for count, name in dict.fromkeys((row["motions"], row["step"]) for row in rows):
        pair = [by.get((count, name, layout), {}) for layout in LAYOUTS]
        cells = [_shown(row.get(unit)) for row in pair for unit in ("s", "cpu_s", "peak_mb")]
        old, new = (row.get("cpu_s") for row in pair)
        lines.append(f"| {count:,} | {name} | {' | '.join(cells)} | {_shown(old / new if old and new else None)} |")
        if name == "write":
            sizes = [f"{_shown(row.get('disk_mb'))} MB in {row.get('files', '-')} files" for row in pair]
            lines.append(f"| {count:,} | on disk | {sizes[0]} | | | {sizes[1]} | | | |")
    return "\n".join(lines)


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def _processor_seconds() -> float:
    """User and system, with that of ended children: what other work on the machine changes least."""
    uses = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(use.ru_utime + use.ru_stime for use in uses)


def main(argv: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.motion_store", description=__doc__)
    parser.add_argument("counts", nargs="*", type=int, default=[1000, 8179])
    parser.add_argument("--folder", type=Path, help="where the libraries go for a while (default: the temporary one)")
    parser.add_argument("--single-most", type=int, default=8179, help="more motions than these only in shards")
    parser.add_argument("--json", type=Path, help="the rows as JSON")
    parser.add_argument("--step", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args(argv)
    if options.step:
        layout, name, folder, count = options.step
        for seed in range(KINDS):
            motion(seed)
        began, busy = time.perf_counter(), _processor_seconds()
        step(layout, name, Path(folder), int(count))
        seconds, busy = time.perf_counter() - began, _processor_seconds() - busy
        own, children = (resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        unit = 1e6 if sys.platform == "darwin" else 1e3
        print(
            json.dumps(
                {"s": round(seconds, 3), "cpu_s": round(busy, 3), "peak_mb": round(max(own, children) / unit, 1)}
            )
        )
        return
    rows = []
    for count in options.counts:
        root = Path(tempfile.mkdtemp(prefix="motion-store.", dir=options.folder))
        try:
            rows += measure(count, root, LAYOUTS if count <= options.single_most else LAYOUTS[1:])
        finally:
            shutil.rmtree(root)
    print(table(rows))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
