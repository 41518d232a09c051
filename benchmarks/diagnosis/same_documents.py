"""Do two states of the code diagnose the same, to the digit? diagnosis.json of a fixed sample, without time limits.

    python -m benchmarks.diagnosis.same_documents OUT --policy FOLDER [--workers N] [--dataset FOLDER ...]   in both
    python -m benchmarks.diagnosis.same_documents --compare BEFORE AFTER

The sample is 44 cases of the sealed benchmark (suite seed 7): the arm, the standing and the tracking G1, nulls, pairs,
a triple and effects outside the catalogue. A dataset is a folder with model.xml and rollouts/. Cases that OUT
already holds are skipped. Digits depend on processor and packages: run both on the same machine.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from benchmarks.undeclared.lottery import Case, Suite
from bumblebee.errors import EXIT_BAD_INPUT, BadInput

SEED = 7
SAMPLE = {
    ("track", "single"): 6, ("track", "null"): 2, ("track", "pair"): 1,
    ("stand", "single"): 6, ("stand", "null"): 2, ("stand", "pair"): 2, ("stand", "outside"): 2,
    ("arm", "single"): 13, ("arm", "null"): 3, ("arm", "outside"): 4, ("arm", "pair"): 2, ("arm", "triple"): 1,
}  # fmt: skip
"""How many cases of each robot and group; singles of different kinds each."""
MOST_ROLLOUTS = 4


def sample() -> Iterator[Case]:
    """The cases, those that take longest first."""
    cases, seen = Suite(SEED).cases(), set()
    for (robot, group), count in SAMPLE.items():
        for case in cases:
            fits = (case.robot, case.group) == (robot, group) and case.rollouts <= MOST_ROLLOUTS
            if count and fits and (group != "single" or case.kinds not in seen):
                count -= 1
                seen.add(case.kinds)
                yield case


def name_of(job: Case | Path) -> str:
    """Name of a result's file."""
    return job.name if isinstance(job, Path) else f"{job.number:03d}-{job.robot}-{job.group}"


def document(job: Case | Path, policy: Path | None) -> str:
    """diagnosis.json of a case or a dataset; of one that breaks, how."""
    import mujoco

    from benchmarks.undeclared.draw import draw
    from bumblebee.diagnosis.config import DiagnosisConfig
    from bumblebee.diagnosis.dataset import make_session, open_session
    from bumblebee.diagnosis.diagnose import diagnose

    mujoco.set_mju_user_warning(lambda text: None)
    unlimited = DiagnosisConfig(
        max_windows=40, max_holdout_windows=20, report_windows=30, search_seconds=1e9, beyond_seconds=1e9
    )
    try:
        if isinstance(job, Path):
            session = open_session(job / "model.xml", job)
        else:
            drawn = draw(job, SEED, policy)
            session = make_session(drawn.robot.spec.copy(), drawn.shown, drawn.robot.name, "sample")
        told = diagnose(session, unlimited).document
    except Exception as error:  # a case that breaks must break in the same way
        told = {"failed": f"{type(error).__name__}: {error}"}
    return json.dumps(told, default=_plain, sort_keys=True, indent=1)


def differences(before: Path, after: Path) -> list[str]:
    """Names of results that are not the same in both folders."""
    found = sorted({path.name for folder in (before, after) for path in folder.glob("*.json")})
    if not found:
        raise BadInput(before, "results of an earlier run", "none")
    return [name for name in found if _bytes(before / name) != _bytes(after / name)]


def _bytes(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def _plain(value: object) -> object:
    return value.tolist() if hasattr(value, "tolist") else str(value)


def single_threads() -> None:
    """One thread a process, of those that are yet to be started."""
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[variable] = "1"


def write(job: Case | Path, policy: Path | None, out: Path) -> str:
    part = out / f"{name_of(job)}.part"
    part.write_text(document(job, policy))
    part.rename(part.with_suffix(".json"))
    return name_of(job)


def main(argv: list[str] | None = None) -> int:
    """Run or compare; returns the exit status, 1 where results differ."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.diagnosis.same_documents",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_options(parser)
    parser.add_argument("--compare", type=Path, nargs=2, metavar=("BEFORE", "AFTER"), help="two folders of results")
    options = parser.parse_args(argv)
    try:
        if options.compare:
            differ = differences(*options.compare)
            print("\n".join([*differ, f"{len(differ)} differ"]))
            return int(bool(differ))
        if options.out is None:
            raise BadInput("OUT", "a folder for the results", "none")
        run(options)
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of a run of the sample."""
    parser.add_argument("out", type=Path, nargs="?", help="folder of the results")
    parser.add_argument("--policy", type=Path, help="folder of an exported policy, for the G1 that tracks motions")
    parser.add_argument("--dataset", type=Path, nargs="*", default=[], help="real datasets beside the sample")
    parser.add_argument("--workers", type=int, default=1, help="processes, one core each")


def left(options: argparse.Namespace) -> list[Case | Path]:
    """Every case and dataset that is not there yet."""
    if options.policy is None:
        print("no --policy: the G1 that tracks motions is left out")
    jobs = [*options.dataset, *(case for case in sample() if options.policy or case.robot != "track")]
    return [job for job in jobs if not (options.out / f"{name_of(job)}.json").exists()]


def run(options: argparse.Namespace) -> None:
    """Diagnose what is left, a process a document."""
    single_threads()
    options.out.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(options.workers) as pool:
        done = [pool.submit(write, job, options.policy, options.out) for job in left(options)]
        for future in as_completed(done):
            print(future.result(), flush=True)


if __name__ == "__main__":
    sys.exit(main())
