"""How often ingestion's checks set aside honest rollouts, and how often they see one reversed joint.

`python -m benchmarks.diagnosis.false_signs --draws 1000 1100 --out signs.csv --workers 32`: for each draw of effects
the shipped policy follows every embedded motion on the stand-in robot. Every rollout is checked as it is, and once
more with the commands of one moving joint reversed, chosen by the draw's seed. Prints both rates with 95 % intervals
(Clopper and Pearson 1934); the draws of the tests and those that the thresholds were chosen on are below 200.
"""

import argparse
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
from scipy.stats import beta

from bumblebee.evaluation.contract import StartNoise
from bumblebee.learning import pretrained
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import load_policy
from bumblebee.measured.checks import check_rollout
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import SideBySide
from bumblebee.robot.model import write_xml
from bumblebee.robot.sensors import SensorNoise
from bumblebee.stand_in.body import StandInRobots
from tasks.on_robot.stand_in import cut
from tasks.seal import SealConfig, draw

SECONDS = 10.0  # of each motion at most
MOVING = 0.02  # rad: standard deviation of the commands of a joint that moves


def main() -> None:
    """Draw, run, check, print."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.diagnosis.false_signs", description=__doc__)
    made.add_argument("--draws", type=int, nargs=2, default=(1000, 1004), help="seeds: first, and one after the last")
    made.add_argument("--out", type=Path, help="CSV of every finding's counts, a row a rollout")
    made.add_argument("--workers", type=int, default=1)
    options = made.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        export_policy(Path(folder), load_policy(pretrained.FOLDER))
        jobs = [(seed, folder) for seed in range(*options.draws)]
        with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
            rows = [row for part in pool.map(one_draw, *zip(*jobs, strict=True)) for row in part]
    table = pd.DataFrame(rows)
    if options.out:
        table.to_csv(options.out, index=False)
    for name, column in (
        ("honest rollouts with a false sign", "false_sign"),
        ("honest rollouts set aside for any reason", "set_aside"),
        ("rollouts with one joint reversed, found", "reversed_found"),
    ):
        known = table[column].dropna().astype(bool)
        low, high = interval(int(known.sum()), len(known))
        print(f"{name}: {known.sum()} of {len(known)}, {known.mean():.2%} [{low:.2%}, {high:.2%}]")
    print(table[table.set_aside].reasons.value_counts().to_string())


def one_draw(seed: int, folder: str) -> list[dict[str, object]]:
    """All motions on one drawn robot: a row a rollout."""
    mujoco.set_mju_user_warning(lambda text: None)
    policy = ExportedPolicy.load(Path(folder))
    clips = [cut(clip, SECONDS) for clip in make_library(EmbeddedConfig())]
    effects = draw(SealConfig(seed=seed, n_effects=1 + seed % 4))
    rng = np.random.default_rng(seed)
    model = declared()
    return [judge(rollout, model, rng, seed) for rollout in rollouts(policy, clips, effects, seed)]


def rollouts(policy: ExportedPolicy, clips: list[Clip], effects: list[dict], seed: int) -> Iterator[Rollout]:
    """The policy on every clip."""
    episodes = [Episode(f"d{seed}-{clip.name}", "policy", clip.name, seed, {}) for clip in clips]
    robots = lambda count: SideBySide(lambda part: StandInRobots(part, effects), count, 1)  # noqa: E731
    known = {clip.name: clip for clip in clips}
    yield from run_episodes(robots, episodes, {"policy": policy}, known, SensorNoise(), StartNoise())


def declared() -> mujoco.MjModel:
    """The declared G1."""
    with tempfile.TemporaryDirectory() as folder:
        write_xml(Path(folder) / "model.xml")
        return mujoco.MjModel.from_xml_path(str(Path(folder) / "model.xml"))


def judge(rollout: Rollout, model: mujoco.MjModel, rng: np.random.Generator, seed: int) -> dict[str, object]:
    """Findings of the checks on it as it is, and with one joint's commands reversed about its rest."""
    fatal = [finding for finding in check_rollout(rollout, model) if finding.fatal]
    row = {"seed": seed, "rollout": rollout.rollout_id, "seconds": rollout.duration}
    row |= {"false_sign": any(each.rule == "response-sign" for each in fatal), "set_aside": bool(fatal)}
    row |= {"reasons": ", ".join(sorted({each.rule for each in fatal})), "reversed_found": None}
    assert rollout.joint_target is not None
    moving = np.flatnonzero(rollout.joint_target.std(axis=0) >= MOVING)
    if not len(moving):
        return row
    joint, target = int(rng.choice(moving)), rollout.joint_target.copy()
    target[:, joint] *= -1.0
    found = check_rollout(replace(rollout, joint_target=target), model)
    label = f"[{rollout.joints[joint]}]"
    row["reversed_found"] = any(each.fatal and each.column.endswith(label) for each in found)
    return row | {"joint": rollout.joints[joint]}


def interval(hits: int, count: int) -> tuple[float, float]:
    """Clopper and Pearson's 95 % interval of a share."""
    low = beta.ppf(0.025, hits, count - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, count - hits) if hits < count else 1.0
    return float(low), float(high)


if __name__ == "__main__":
    main()
