"""Stage seal: draws the stand-in robot's undeclared effects by seed and seals them in data/sealed/robot.json.

A robot on which the policy that the loop begins from loses next to nothing has nothing to win back: it is drawn again,
a little worse, until the policy loses a share of the motions. Only the stand-in's process reads it, and the report
at the very end. With a real robot this stage has no use, and nothing is tried.
"""

import json
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from bumblebee.evaluation.thinning import thin
from bumblebee.learning import pretrained
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import load_policy
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_index, read_library
from bumblebee.ranges import Count, Few, Name, PartOf, Range, Ranged, Seed, Share
from bumblebee.robot.facts import PELVIS, ROBOT, joint_names, limb, limb_bodies, robot_bodies
from bumblebee.robot.written import SIDES
from bumblebee.stand_in.sealed import SCHEMA, declared_g1, entry, seal
from bumblebee.stand_in.undeclared.faults import largest, peaks
from bumblebee.stand_in.undeclared.kinds import KINDS, Kind, Place, fits
from tasks.on_robot.seal_trial import Trial, followed, try_robot
from tasks.on_robot.stand_in import cut
from tasks.running import paths
from tasks.running.stage import load, log_run, output_file, run_stage
from tasks.settings import params
from tasks.settings.rollouts_config import RolloutsConfig

WORSE = 1.1  # sizes of a draw over those of the draw before
SMALLEST = 0.4  # share of a kind's largest size that every size has, before `severity`
LIGHT = 0.25  # kg: bodies below are left out, an effect on them is none
OF_G1 = tuple(name for name, kind in KINDS.items() if fits(kind, "g1"))
BODIES = tuple(name for name, body in robot_bodies().items() if float(body["mass"]) >= LIGHT)


@dataclass(frozen=True)
class SealConfig(Ranged):
    """Settings of what may be sealed."""

    seed: Seed = 7
    """Seed of the draw."""
    n_effects: Annotated[int, Range(least=0, most=1000)] = 4
    """Number of effects, each of another kind at another place; 0: the diagnosis' null test."""
    kinds: tuple[Name, ...] = OF_G1
    """Kinds to draw from, those of the diagnosis' catalogue and those outside it."""
    outside: Share = 0.34
    """Chance that one of the effects, never more, is of a kind outside the catalogue."""
    severity: Annotated[float, Range(above=0, most=100)] = 1.5
    """Factor on the sizes, which are else 0.4 to 1.0 of the largest fault of their kind and never above it."""
    loses: PartOf = 1 / 3
    """Share of the motions, of those that it follows on the declared model, that the policy must lose."""
    stands: Annotated[float, Range(least=0, most=3600)] = 2.0
    """Median time that it must follow a motion all the same [s]: a robot that falls at once gives no data."""
    draws: Count = 20
    """How often a robot is drawn at most; each draw is a tenth worse than the one before."""
    motions: Count = 12
    """Motions of the trial."""
    max_seconds: Annotated[float, Range(least=0.1, most=3600)] = 6.0
    """Longer motions are cut to their beginning [s]."""
    trial_seed: Seed = 977
    """Seed of the trial's start states and sensor noise; no other stage uses it."""
    threads: Few = 2
    """CPU threads of the trial."""
    joints: tuple[Name, ...] = joint_names()
    """Joints to draw from."""
    bodies: tuple[Name, ...] = BODIES
    """Bodies to draw from, for what sits on a body."""

    def __post_init__(self) -> None:
        """Refuse names that do not exist, and more effects than kinds or places."""
        super().__post_init__()
        self.require_names("kinds", OF_G1)
        self.require_names("joints", joint_names())
        self.require_names("bodies", BODIES)
        for field, on in (("joints", "joint"), ("bodies", "body")):
            needed = next((kind.name for kind in self.of(self.kinds) if kind.on == on), "")
            self.require(bool(getattr(self, field)) or not needed, field, f"at least one for {needed}")
        most = self.room(strange=True)
        self.require(self.n_effects <= most, "n_effects", f"at most {most}, as many as there are kinds and places")

    @staticmethod
    def of(names: Iterable[str], outside: bool | None = None) -> list[Kind]:
        """The kinds of these names: all, those outside the catalogue, or those in it."""
        return [KINDS[name] for name in names if outside is None or KINDS[name].outside == outside]

    def room(self, strange: bool) -> int:
        """How many effects fit the kinds and places, with one from outside the catalogue (if there is) or without."""
        kinds = self.of(self.kinds, outside=False) + (self.of(self.kinds, outside=True)[:1] if strange else [])
        return sum(
            min(sum(kind.on == on for kind in kinds), len(self.spots(on))) for on in ("joint", "body", "base", "whole")
        )

    def spots(self, on: str) -> Sequence[str]:
        """Names of the places for what sits on a joint, on a body, on the base (its IMU) or on the whole robot."""
        return {"joint": self.joints, "body": self.bodies, "base": (PELVIS,)}.get(on, ("",))


def main() -> None:
    """Draw until the robot is worth it, and seal."""
    config = load("seal", SealConfig)
    rehearsed = load("rollouts", RolloutsConfig).source is None
    begun = begun_from()
    tried = begun is not None and config.n_effects and rehearsed
    sealed = found(config, trial_clips(config), begun) if begun and tried else sealed_robot(config, 0)
    with output_file(paths.SEALED_ROBOT) as path:
        path.write_text(json.dumps(sealed, indent=1) + "\n")
    print(f"sealed {len(sealed['effects'])} effects, sha256 {sealed['sha256'][:12]}")
    log_run("seal", params=config, metrics=sealed.get("trial", {}), tags={"sealed": sealed["sha256"]})


def begun_from() -> Path | None:
    """Folder of the policy to try: the user's own where the loop begins from it, else our G1's that comes along."""
    if (params.read().get("base") or {}).get("init") == "own":
        return paths.POLICY
    return pretrained.FOLDER if ROBOT == pretrained.THEIRS else None


def found(config: SealConfig, motions: Sequence[Clip], begun: Path) -> dict[str, Any]:
    """The first robot drawn on which the policy in `begun` loses enough, and stands long enough to be measured.

    Where there is none among the draws, the one on which it loses most: a line says so, and the loop goes on.
    """
    with tempfile.TemporaryDirectory() as scratch:
        policy = Path(scratch)
        export_policy(policy, load_policy(begun))
        clips = followed(policy, motions, config.trial_seed, config.threads)
        if not clips:
            print("the policy follows none of the trial's motions on the declared model: no loss to measure")
            return sealed_robot(config, 0)
        tried: list[tuple[Trial, dict[str, Any]]] = []
        for attempt in range(config.draws):
            sealed = sealed_robot(config, attempt)
            trial = try_robot(policy, sealed, clips, config.trial_seed, config.threads)
            tried.append((trial, sealed | {"trial": {**asdict(trial), "motions": len(clips)}}))
            worth = trial.lost >= config.loses and trial.seconds >= config.stands
            lost = f"the policy loses {trial.lost:.0%} of {len(clips)} motions, median {trial.seconds:.1f} s"
            print(f"draw {attempt + 1}: {lost}{'' if worth else ', not taken'}", flush=True)
            if worth:
                return tried[-1][1]
    trial, sealed = max(tried, key=lambda one: (one[0].seconds >= config.stands, one[0].lost))
    print(f"none of {config.draws} draws loses {config.loses:.0%}: the one that loses {trial.lost:.0%} is sealed")
    return sealed


def trial_clips(config: SealConfig) -> list[Clip]:
    """Some training motions of every family, cut to their beginning."""
    index = read_index(paths.FILTERED)
    own = index[index["split"] == "train"]
    names = thin(own.assign(cluster=own["family"]), config.motions)
    return [cut(clip, config.max_seconds) for clip in read_library(paths.FILTERED, names)]


def sealed_robot(config: SealConfig, attempt: int) -> dict[str, Any]:
    """Content of the file after so many draws that were drawn again."""
    effects = draw(config, attempt)
    return {
        "schema": SCHEMA,
        "sealed": "Undeclared effects of the stand-in robot, for its process and the final report only.",
        "seed": config.seed,
        "attempt": attempt,
        "effects": effects,
        "sha256": seal(effects),
    }


def draw(config: SealConfig, attempt: int = 0) -> list[dict[str, Any]]:
    """The effects as they stand in the file; the same configuration and attempt give the same effects."""
    rng = np.random.default_rng([config.seed, attempt])
    inside, outside = (config.of(config.kinds, outside=which) for which in (False, True))
    strange = rng.random() < config.outside or config.n_effects > config.room(strange=False)
    order = [outside[int(rng.integers(len(outside)))]] if outside and strange else []
    order += [inside[i] for i in rng.permutation(len(inside))]
    effects: list[dict[str, Any]] = []
    taken: set[tuple[str, str]] = set()
    for kind in order:
        free = [name for name in config.spots(kind.on) if (kind.on, name) not in taken]
        if len(effects) == config.n_effects or not free:
            continue
        place = drawn_place(somewhere(free, rng), rng)
        taken.add((kind.on, place.name))
        effects.append(entry(kind, place, size(kind, place, config.severity * WORSE**attempt, rng)))
    return [effects[i] for i in rng.permutation(len(effects))]


def somewhere(names: Sequence[str], rng: np.random.Generator) -> str:
    """One of the places: half of the time in the legs, else in the waist or in the arms, each as often."""
    regions = [[n for n in names if region(n) == which] for which in ("leg", "leg", "waist", "arm")]
    free = [some for some in regions if some]
    return str(rng.choice(free[int(rng.integers(len(free)))]))


def region(name: str) -> str:
    """Where a joint or body is: leg, waist or arm; what is neither counts as waist."""
    for which, end in (("leg", "foot"), ("arm", "hand")):
        if any(name in (*limb_bodies(side, end), *limb(side, end)) for side in SIDES):
            return which
    return "waist"


def drawn_place(name: str, rng: np.random.Generator) -> Place:
    """A place with what a size leaves open, and what the declared robot does there."""
    robot = declared_g1()
    drawn = {
        "sign": int(rng.choice([-1, 1])),
        "axis": int(rng.integers(3)),
        "number": int(rng.integers(4, 13)),
        "other": str(rng.choice([joint for joint in robot.joints if joint != name])),
    }
    return Place(robot, name, drawn, *peaks().get(name, (0.0, 0.0, 0.0)))


def size(kind: Kind, place: Place, severity: float, rng: np.random.Generator) -> float:
    """A size that matters, of four digits, in the kind's own measure: 0.4 to 1.0 of a fault, times `severity`."""
    most = largest(kind, place)
    wanted = float(f"{most * min(1.0, severity * rng.uniform(SMALLEST, 1.0)):.4g}")
    return float(np.clip(wanted, kind.least(place), most))


if __name__ == "__main__":
    run_stage(main)
