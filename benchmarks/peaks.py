"""How much each joint of the declared G1 does under the shipped policy: what limits in the stand-in are measured by.

`python -m benchmarks.peaks --out bumblebee/stand_in/undeclared/peaks.yaml`: the shipped policy follows every embedded
motion on the stand-in without effects, from the motion's own start, without sensor noise. Of each motion the largest
torque, speed and change of the target are taken, and of these the median over the motions: a limit below it is felt in
half of them.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from bumblebee.evaluation.contract import StartNoise
from bumblebee.learning import pretrained
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import load_policy
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.policy.episodes import start_states
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import CONTROL_HZ
from bumblebee.policy.runner import PolicyRunner, reference_library
from bumblebee.robot.facts import joint_names
from bumblebee.stand_in.body import StandInRobots

HEAD = """# Median over the embedded motions of each motion's peak under the shipped policy on the declared G1, from
# `python -m benchmarks.peaks`: [torque of the drive N m, speed rad/s, change of the target rad/s].
"""


def main() -> None:
    """Run and write."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.peaks", description=__doc__)
    made.add_argument("--out", type=Path, required=True)
    out: Path = made.parse_args().out
    with tempfile.TemporaryDirectory() as folder:
        export_policy(Path(folder), load_policy(pretrained.FOLDER))
        table = peaks(ExportedPolicy.load(Path(folder)), make_library(EmbeddedConfig()))
    rows = (f"{name}: [{', '.join(f'{x:.3g}' for x in row)}]" for name, row in zip(joint_names(), table, strict=True))
    out.write_text(HEAD + "\n".join(rows) + "\n")


def peaks(policy: ExportedPolicy, clips: list[Clip]) -> np.ndarray:
    """(J, 3): medians over the clips of the peaks of torque [N m], speed [rad/s] and change of the target [rad/s]."""
    runner = PolicyRunner(policy, reference_library(policy, clips), [clip.name for clip in clips])
    robots, lengths = StandInRobots(len(clips), []), np.array([clip.frames for clip in clips])
    qpos, qvel = start_states(clips, [np.random.default_rng(0)] * len(clips), StartNoise(0.0, 0.0))
    robots.reset(qpos, qvel, runner.hold())
    most, before = np.zeros((3, len(clips), qpos.shape[1] - 7)), np.full((len(clips), qpos.shape[1] - 7), np.nan)
    for tick in range(int(lengths.max())):
        alive = np.flatnonzero(tick < lengths)
        sensors = robots.read()[alive]
        command = runner.step(alive, tick, sensors)[1]
        rate = (command.target - before[alive]) * CONTROL_HZ
        now = np.abs(np.stack((sensors.joint_torque, sensors.joint_vel, np.nan_to_num(rate))))
        most[:, alive] = np.maximum(most[:, alive], now)
        before[alive] = command.target
        robots.step(alive, command)
    return np.median(most, axis=1).T


if __name__ == "__main__":
    main()
