"""Success over the wire against the stepped simulation: same robot, policy and motions; pairs are compared.

Stepped three times: as it is, with the wire's latency as a delay of all commands, and with that from the state in which
the gantry let the robot go. Over the wire twice: with the guard's rules, and with `tilt` alone, the rule by which the
stepped simulation counts a fall. So each way differs from the one before by one thing: latency, start, wire, rules.
"""

import argparse
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pandas as pd

from benchmarks.wire.common import clips, shipped
from bumblebee import quaternions
from bumblebee.evaluation.intervals import bootstrap_mean, mcnemar_test, sign_flip_test, wilson
from bumblebee.motion.clip import Clip
from bumblebee.policy import episodes
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.robot.facts import joint_names
from bumblebee.robot.sensors import SensorNoise
from bumblebee.stand_in.body import StandInRobots
from bumblebee.stand_in.sealed import Json, read_sealed
from bumblebee.stand_in.undeclared.signals import CommandDelay
from bumblebee.tracking.terminations import Stop
from bumblebee.wire.journal import Entry
from bumblebee.wire.policy_end.align import aligned
from bumblebee.wire.rehearsal import Rehearsal
from bumblebee.wire.robot_end.stand_in import prepared, records_of
from bumblebee.wire.rollouts import latency
from bumblebee.wire.safety.limits import Limits
from bumblebee.wire.safety.phases import Phase

WAYS = ("stepped", "delayed", "let go", "tilt alone", "wire")
PAIRS = (*pairwise(WAYS), ("stepped", "wire"), ("delayed", "wire"))
Start = tuple[np.ndarray, np.ndarray]
"""A robot's qpos (7 + J,) and qvel (6 + J,)."""
TILT_ALONE = Limits(beyond=1.0, speed=100, power=100, far=100, stall=60, air=60)


def run(options: argparse.Namespace) -> None:
    policy, motions = shipped(), evenly(clips(options.motions), options.most)
    options.out.mkdir(parents=True, exist_ok=True)
    parts = [compared(policy, motions, path, options.seed) for path in options.sealed or [None]]
    table = pd.concat(parts, ignore_index=True)
    table.to_csv(options.out / "success.csv", index=False)
    print("\n".join(told(table)))


def compared(policy: ExportedPolicy, motions: Sequence[Clip], sealed: Path | None, seed: int) -> pd.DataFrame:
    """A row for each motion on one robot: whether each way followed it to its end, and what ended it on the wire."""
    effects, rows, starts = read_sealed(sealed) if sealed else [], [], []
    for clip in motions:
        run = prepared(policy, clip, effects, seed)
        records, start = followed(run)
        starts.append(start)
        late, reason = latency(records), run.guard.reason
        alone = reason  # the run is the same until a rule ends it
        if reason not in ("", "tilt"):
            with_tilt = prepared(policy, clip, effects, seed, TILT_ALONE)
            followed(with_tilt)
            alone = with_tilt.guard.reason
        rows.append((clip.name, not reason, reason, not alone, late.median if late else np.nan))
        print(
            f"{sealed or 'nothing sealed'}: {clip.name}: {reason or 'to the end'}, {alone or 'to the end'}", flush=True
        )
    table = pd.DataFrame(rows, columns=["motion", "wire", "rule", "tilt alone", "latency"])
    table.insert(0, "robot", sealed.stem if sealed else "declared")
    table["stepped"] = stepped(policy, motions, effects, seed, 0.0)
    delay = float(table["latency"].median())
    table["delayed"] = stepped(policy, motions, effects, seed, delay)
    with patch.object(episodes, "start_states", partial(in_place, starts)):
        table["let go"] = stepped(policy, motions, effects, seed, delay)
    return table


def followed(run: Rehearsal) -> tuple[np.ndarray, Start]:
    """A run's records, and the state in which the gantry let the robot go, or the last one."""
    batch, entries, start = run.robot.robots.batch, list[Entry](), None
    for entry in run.entries():
        entries.append(entry)
        if start is None and entry.tick.phase >= Phase.RUN:
            start = batch.bind("qpos")[0].copy(), batch.bind("qvel")[0].copy()
    return records_of(run, entries), start or (batch.bind("qpos")[0].copy(), batch.bind("qvel")[0].copy())


def in_place(starts: Sequence[Start], clips: Sequence[Clip], *rest: object) -> Start:
    """Starts of all robots, moved in the plane to where the clips begin, heading as they do."""
    qpos, qvel = (np.stack(part) for part in zip(*starts, strict=True))
    for pos, vel, clip in zip(qpos, qvel, clips, strict=True):
        at = aligned(pos[:3], pos[3:7], clip.root_pos[0].astype(float), clip.root_quat[0].astype(float))
        pos[:3], pos[3:7] = at.seen(pos[:3], pos[3:7])
        vel[:3] = quaternions.rotate(at.turn, vel[:3])
    return qpos, qvel


def stepped(
    policy: ExportedPolicy, motions: Sequence[Clip], effects: list[Json], seed: int, delay: float
) -> list[bool]:
    """Whether each motion is followed to its end, by the guard's own rule `tilt`, where all commands come late [s]."""
    late = [CommandDelay(joint, delay) for joint in joint_names()] if delay else []
    limits, by_name = Limits(), {clip.name: clip for clip in motions}
    rollouts = run_episodes(
        lambda count: StandInRobots(count, effects, late),
        [Episode(name, "p", name, seed) for name in by_name],
        {"p": policy},
        by_name,
        SensorNoise(base="odometry"),
        stop=Stop(limits.tilt_deg, limits.drop_m),
    )
    return [rollout.frames == clip.frames for rollout, clip in zip(rollouts, motions, strict=True)]


def evenly(motions: Sequence[Clip], most: int) -> list[Clip]:
    """At most so many of the motions, as far apart in their order as they can be."""
    count = min(most, len(motions))
    return [motions[int((k + 0.5) * len(motions) / count)] for k in range(count)]


def told(table: pd.DataFrame) -> list[str]:
    """Shares of each robot and way with Wilson's interval, and the paired differences."""
    lines = []
    for robot, part in table.groupby("robot", sort=False):
        for way in WAYS:
            won = int(part[way].sum())
            low, high = wilson(won, len(part))
            lines.append(f"{robot}, {way}: {won} of {len(part)}, {won / len(part):.0%} [{low:.0%}, {high:.0%}]")
        rules = ", ".join(f"{name} {count}" for name, count in part["rule"].value_counts().items() if name)
        lines.append(f"{robot}: latency {1e3 * part['latency'].median():.1f} ms; ended by {rules or 'no rule'}")
        lines += [f"{robot}: {paired(part, *pair)}" for pair in PAIRS]
    return lines + ([f"all robots: {pooled(table, *pair)}" for pair in PAIRS] if table["robot"].nunique() > 1 else [])


def paired(part: pd.DataFrame, first: str, second: str) -> str:
    """One robot's motions that only one of two ways followed, and McNemar's exact test."""
    one, other = (part[way].to_numpy(bool) for way in (first, second))
    gained, lost = int((other & ~one).sum()), int((one & ~other).sum())
    return f"{second} against {first}: gained {gained}, lost {lost}, p = {mcnemar_test(one, other):.2g}"


def pooled(table: pd.DataFrame, first: str, second: str) -> str:
    """Mean difference over motions, of which each is one piece of evidence on however many robots."""
    each = (table[second].astype(float) - table[first].astype(float)).groupby(table["motion"]).mean().to_numpy()
    low, high = bootstrap_mean(each)
    size = f"{100 * each.mean():+.1f} points [{100 * low:+.1f}, {100 * high:+.1f}]"
    return f"{second} against {first}: {size}, p = {sign_flip_test(each):.2g}"
