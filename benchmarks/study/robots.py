"""Three sealed stand-in robots on which a base policy loses about half of what it follows.

    python -m benchmarks.study.robots run/base --motions motions --out robots

A robot's effects, their kinds, places and relative sizes, are drawn by a frozen seed: one of the ground, one that no
catalogue has, three of the catalogue. One factor on all sizes is then searched by bisection until the policy's success
is between `at_least` and `at_most`. It is tried as it will be measured: sensor noise, and a base whose place is known
from drifting odometry. The motions of a trial are training motions that it follows on the declared robot in the same
manner and from the same starts; there the declared robot, the control, therefore has success 1. The rounds use other
seeds: what they say of the declared robot is the measure of how much of the loss is the choice of these motions.

`--ankles` seals robots that differ at the ankles alone: what a delta action, which acts there, can correct.

Writes robot-0.json ..., sealed as `tasks.seal` seals, and declared.json, without effects; nothing printed names an
effect. Only processors are used; onnxruntime is needed. Each try is kept: the same command goes on. Twice
`motions` are tried on the declared robot, since a base policy of success well below 1 does not follow all; a try of 24
motions then simulates at most 192 s. Three robots took 8 tries, less than 7 minutes on one core that others used, too.
"""

import argparse
import json
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.on_robot import KEY, exported, run_on_robot
from benchmarks.study.settings import freeze
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.thinning import thin
from bumblebee.io.read import file_hash
from bumblebee.io.write import write_file
from bumblebee.motion.clip import Clip
from bumblebee.policy.episodes import Episode
from bumblebee.stand_in.process import BASES
from bumblebee.stand_in.sealed import SCHEMA, entry, read_sealed, seal
from bumblebee.stand_in.undeclared.kinds import KINDS, Kind, Place
from tasks.on_robot.seal_trial import episodes, to_the_end
from tasks.on_robot.stand_in import cut
from tasks.seal import OF_G1, SealConfig, drawn_place, size, somewhere

DECLARED = "declared.json"
GROUND = ("ground_compliance", "ground_friction")


@dataclass(frozen=True)
class RobotsConfig:
    """Settings of the draw, and when a robot is taken."""

    name: str = "robot"
    """Name of each robot, with its number."""
    seeds: tuple[int, ...] = (1801, 1802, 1803)
    """One for each robot."""
    fixed: tuple[tuple[tuple[str, str, str], ...], ...] = ()
    """Effects of each robot: kind, joint and, for a law of two joints, the other, else ""; (): they are drawn."""
    inside: int = 3
    """Effects of the catalogue beside the one of the ground."""
    outside: int = 1
    """Effects that are in no catalogue."""
    at_least: float = 0.3
    at_most: float = 0.6
    """Bounds of the policy's success on the trial's motions."""
    stands: float = 2.0
    """Median time that it must follow a motion [s]: a robot that falls at once gives no data."""
    first: float = 0.6
    """Factor on all sizes that is tried first; at 1 a size is .4 to 1 of the largest fault of its kind."""
    most: float = 2.5
    """Factor at which all sizes are the largest."""
    tries: int = 7
    """Factors tried on a draw; where none does, effects are drawn anew."""
    draws: int = 4
    """Draws of effects for a robot."""
    motions: int = 24
    """Motions of a trial, all clusters among them."""
    max_seconds: float = 8.0
    """Longer motions are cut to their beginning [s]."""
    base: str = BASES[1]
    """Source of the base's place for the robot."""
    trial_seed: int = 1899
    """Seed of start states and sensor noise; the rounds use others."""


_PITCH, _KNEE = "{}_ankle_pitch_joint", "{}_knee_joint"
_WEAK = tuple(("motor_strength", _PITCH.format(side), "") for side in ("left", "right"))
_CABLES = tuple(("cross_coupling", _PITCH.format(side), _KNEE.format(side)) for side in ("left", "right"))
ANKLES = RobotsConfig(name="ankles", seeds=(1811, 1812), fixed=(_WEAK, _CABLES), draws=1)
"""Weak ankles, which the diagnosis has a name for, and a cable over knee and ankle, for which it has none."""
SMALL_CONFIG = RobotsConfig(seeds=(1801,), motions=2, max_seconds=0.6, stands=0.0, tries=2, draws=1)
"""For tests: it shows that every step runs, and nothing else."""


@dataclass(frozen=True)
class Outcome:
    """A policy's trial on a robot."""

    success: float
    seconds: float
    """Median time that a motion was followed [s]."""


Try = Callable[[int, float], Outcome]
"""Attempt of a draw and factor -> what the policy does there."""


def drawn(config: RobotsConfig, seed: int, attempt: int) -> list[tuple[Kind, Place]]:
    """Kinds and places of a robot's effects, no two at one place; the same seed and attempt give the same."""
    if config.fixed:
        return _not_drawn(config.fixed[config.seeds.index(seed)], np.random.default_rng([seed, attempt]))
    rng, spots = np.random.default_rng([seed, attempt]), SealConfig()
    inside = [kind for kind in SealConfig.of(OF_G1, outside=False) if kind.group != "contact"]
    outside = SealConfig.of(OF_G1, outside=True)
    ground = SealConfig.of(GROUND)
    first = [ground[int(rng.integers(len(ground)))]] + [
        outside[i] for i in rng.permutation(len(outside))[: config.outside]
    ]
    order = first + [inside[i] for i in rng.permutation(len(inside))]
    effects: list[tuple[Kind, Place]] = []
    taken: set[tuple[str, str]] = set()
    for kind in order:
        free = [name for name in spots.spots(kind.on) if (kind.on, name) not in taken]
        if free and len(effects) < len(first) + config.inside:
            place = drawn_place(somewhere(free, rng), rng)
            taken.add((kind.on, place.name))
            effects.append((kind, place))
    return effects


def _not_drawn(effects: Sequence[tuple[str, str, str]], rng: np.random.Generator) -> list[tuple[Kind, Place]]:
    found = []
    for kind, joint, other in effects:
        place = drawn_place(joint, rng)
        found.append((KINDS[kind], replace(place, draw=place.draw | ({"other": other} if other else {}))))
    return found


def sized(config: RobotsConfig, seed: int, attempt: int, factor: float) -> list[dict[str, Any]]:
    """A robot's effects as they stand in a sealed file; a larger factor makes none of them smaller."""
    return [
        entry(kind, place, size(kind, place, factor, np.random.default_rng([seed, attempt, index])))
        for index, (kind, place) in enumerate(drawn(config, seed, attempt))
    ]


def search(config: RobotsConfig, tried: Try) -> tuple[int, float, Outcome] | None:
    """The first attempt and factor whose robot is taken; None where none is.

    Bisection in the factor: up where the policy succeeds too often, down where too seldom or it falls at once.
    """
    for attempt in range(config.draws):
        low, high, factor = 0.0, None, config.first
        for _ in range(config.tries):
            outcome = tried(attempt, factor)
            if outcome.success > config.at_most:
                low = factor
            elif outcome.success < config.at_least or outcome.seconds < config.stands:
                high = factor
            else:
                return attempt, factor, outcome
            if low >= config.most:
                break
            factor = min(2 * low, config.most) if high is None else 0.5 * (low + high)
    return None


def trial(
    policy: Path, effects: list[dict[str, Any]], clips: Sequence[Clip], config: RobotsConfig, threads: int
) -> tuple[np.ndarray, np.ndarray]:
    """Whether an exported policy follows each clip to its end on the robot, (N,) bool, and for how long, (N,) [s]."""
    planned = [Episode(f"t{i}", KEY, e.motion, e.seed) for i, e in enumerate(episodes(clips, config.trial_seed))]
    with tempfile.TemporaryDirectory() as scratch:
        robot = Path(scratch) / "robot.json"
        robot.write_text(json.dumps(_content(effects)))
        rollouts = run_on_robot(policy, robot, clips, planned, config.base, True, threads)
    ends = [to_the_end(clip, rollout) for clip, rollout in zip(clips, rollouts, strict=True)]
    return np.array(ends), np.array([rollout.duration for rollout in rollouts])


def seal_robots(policy: Path, motions: Motions, config: RobotsConfig, out: Path, threads: int) -> list[Path]:
    """Search and seal what is not sealed yet; the files, the declared robot's first.

    Raises:
        BadInput: if `out` was begun with other settings, or the policy follows too little, or no robot is taken.
    """
    freeze(out, config, policy=file_hash(policy / "policy.pt"), motions=motions.hash)
    paths = [out / DECLARED, *(out / f"{config.name}-{i}.json" for i in range(len(config.seeds)))]
    if not paths[0].exists():
        write_file(paths[0], _plain(_content([])))
    if all(path.exists() for path in paths):
        for path in paths:
            read_sealed(path)
        return paths
    with tempfile.TemporaryDirectory() as scratch:
        own = exported(policy, Path(scratch) / "exported")
        clips = _followed(own, motions, config, out, threads)
        for path, seed in zip(paths[1:], config.seeds, strict=True):
            if not path.exists():
                _seal_one(path, own, clips, config, seed, threads)
            read_sealed(path)
    return paths


def _followed(policy: Path, motions: Motions, config: RobotsConfig, out: Path, threads: int) -> list[Clip]:
    """Motions of the trial, found once and kept by name."""
    kept = out / "followed.json"
    by_name = {row.clip.name: row.clip for row in motions.training()}
    if not kept.exists():
        own = motions.labels[motions.labels["split"] == "train"]
        asked = [cut(by_name[name], config.max_seconds) for name in thin(own, 2 * config.motions)]
        ends, _ = trial(policy, [], asked, config, threads)
        names = [clip.name for clip, end in zip(asked, ends, strict=True) if end]
        print(f"declared robot: the policy follows {len(names)} of {len(asked)} motions", flush=True)
        write_file(kept, _plain({"asked": len(asked), "names": thin(own[own["name"].isin(names)], config.motions)}))
    names = json.loads(kept.read_text())["names"]
    if len(names) < max(2, config.motions // 2):
        raise BadInput(
            kept, f"at least {max(2, config.motions // 2)} motions that the policy follows", str(len(names)),
            "Train the base policy longer.",
        )  # fmt: skip
    return [cut(by_name[name], config.max_seconds) for name in names]


def _seal_one(path: Path, policy: Path, clips: Sequence[Clip], config: RobotsConfig, seed: int, threads: int) -> None:
    """Search one robot, every try kept beside it, and seal it."""
    tries = path.with_suffix(".tries.jsonl")
    known = {(row["attempt"], row["factor"]): row for row in _lines(tries)}

    def tried(attempt: int, factor: float) -> Outcome:
        row = known.get((attempt, factor))
        if row is None:
            ends, seconds = trial(policy, sized(config, seed, attempt, factor), clips, config, threads)
            row = {"attempt": attempt, "factor": factor, "success": float(ends.mean())}
            row["seconds"] = float(np.median(seconds))
            with tries.open("a") as file:
                file.write(json.dumps(row) + "\n")
        outcome = Outcome(row["success"], row["seconds"])
        told = f"success {outcome.success:.2f} of {len(clips)}, median {outcome.seconds:.1f} s"
        print(f"{path.stem}: draw {attempt}, factor {factor:.3g}: {told}", flush=True)
        return outcome

    found = search(config, tried)
    if found is None:
        wanted = f"success of {config.at_least:g} to {config.at_most:g} at some factor"
        raise BadInput(tries, wanted, f"none in {config.draws} draws", "Take another seed.")
    attempt, factor, outcome = found
    about = {"seed": seed, "attempt": attempt, "factor": factor, "trial": {**asdict(outcome), "motions": len(clips)}}
    write_file(path, _plain(_content(sized(config, seed, attempt, factor)) | about))


def _content(effects: list[dict[str, Any]]) -> dict[str, Any]:
    told = "Undeclared effects of the stand-in robot, for its process and the final report only."
    return {"schema": SCHEMA, "sealed": told, "effects": effects, "sha256": seal(effects)}


def _plain(content: dict[str, Any]) -> str:
    return json.dumps(content, indent=1) + "\n"


def _lines(path: Path) -> list[dict[str, Any]]:
    """Tries that were kept. A last line that was cut off by a kill is taken out of the file."""
    if not path.exists():
        return []
    text = path.read_text()
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole)
    return [json.loads(line) for line in whole.splitlines()]


def main(arguments: list[str] | None = None) -> None:
    """Seal the robots; bad input is one line and status 2."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        prog="python -m benchmarks.study.robots",
    )
    parser.add_argument("policy", type=Path, help="folder of the base policy")
    parser.add_argument("--motions", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--ankles", action="store_true", help="robots that differ at the ankles alone")
    parser.add_argument("--small", action="store_true", help="the same in seconds: shows that it runs")
    options = parser.parse_args(arguments)
    config = SMALL_CONFIG if options.small else ANKLES if options.ankles else RobotsConfig()
    try:
        if not (options.policy / "policy.pt").exists():
            raise BadInput(options.policy, "the folder of a trained policy", "no policy.pt in it")
        motions = read_motions(options.motions)
        for path in seal_robots(options.policy, motions, config, options.out, options.threads):
            print(f"{path.name}: sha256 {json.loads(path.read_text())['sha256'][:12]}")
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
