"""Success over the wire against the stepped simulation: same robot, policy and motions; pairs are compared."""

import argparse

import numpy as np

from benchmarks.wire.common import clips, shipped
from bumblebee.deploy.episodes import Episode, run_episodes
from bumblebee.deploy.sensors import SensorNoise
from bumblebee.deploy.stand_in_robots import StandInRobots
from bumblebee.evaluation.intervals import wilson
from bumblebee.wire.stand_in import rehearsed


def run(options: argparse.Namespace) -> None:
    policy, motions = shipped(), clips(options.motions)
    episodes = [Episode(clip.name, "p", clip.name, options.seed) for clip in motions]
    by_name = {clip.name: clip for clip in motions}
    noise = SensorNoise(base="odometry")
    stepped = run_episodes(lambda n: StandInRobots(n, []), episodes, {"p": policy}, by_name, noise)
    both = []
    for clip, rollout in zip(motions, stepped, strict=True):
        done, _ = rehearsed(policy, clip, [], options.seed)
        both.append((rollout.frames == clip.frames, done.guard.reason == ""))
        print(f"{clip.name}: stepped {both[-1][0]}, wire {both[-1][1]} {done.guard.reason}", flush=True)
    for name, wins in zip(("stepped", "wire"), np.array(both).T, strict=True):
        print(f"{name}: {wins.sum()} of {len(wins)}, {wilson(int(wins.sum()), len(wins))}")
    print(f"differ: {sum(a != b for a, b in both)}")
