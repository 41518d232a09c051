"""The stand-in robot behind guard and wire: what it does, and its command line, are `bumblebee.stand_in.process`'s.

    python -m bumblebee.wire.robot_end.stand_in --sealed robot.json --clips LIBRARY --plan plan.json --out DIR

Each episode is a run of `bumblebee deploy run`, from hanging to hanging, in the time of its messages and with LCM's
bytes; the rollout is made of the guard's journal. The robot knows of its base what IMU and odometry say, and the log
has no `base_pos`, whatever the plan's `base` says. A plan's `stop` is the guard's rule `tilt`.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from bumblebee.compensation.numbers import Compensation
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.policy.episodes import Episode
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.robot.facts import ROBOT
from bumblebee.stand_in.process import Play, main
from bumblebee.stand_in.sealed import Json
from bumblebee.wire.journal import Entry, layout, record
from bumblebee.wire.links.line import LineFaults
from bumblebee.wire.plan import ORDER_HZ, Plan
from bumblebee.wire.policy_end.brain import Brain
from bumblebee.wire.rehearsal import Rehearsal
from bumblebee.wire.robot_end.robot import RobotSettings, WireRobot
from bumblebee.wire.rollouts import rollout_of
from bumblebee.wire.safety.intake import numbers_for
from bumblebee.wire.safety.limits import Limits, drives_of
from bumblebee.wire.safety.phases import Ramps

QUICK = Ramps(rise_speed=5.0, rise_least=0.5, soften=0.2, ready=0.2, blend=0.5, stand=0.02, damp=0.1)
"""Ramps of a robot that nobody stands beside."""
LINE = LineFaults(delay=0.001, jitter=0.0005)
"""A cable's line, both ways."""


def over_wire(play: Play) -> list[Rollout]:
    """All episodes, one after the other; those in which the policy never carried the robot are said and left out.

    Raises:
        BadInput: it never did, or the plan asks for true states, which no wire carries.
    """
    if play.work.judged:
        raise BadInput("plan: judged", "readings, as a wire carries them", "true states", "Leave it out.")
    stop, made = play.work.stop, list[Rollout]()
    limits = Limits(tilt_deg=stop.tilt_deg, drop_m=stop.drop_m)
    for episode in play.work.episodes:
        policy, clip = play.policies[episode.policy], play.clips[episode.motion]
        undone = play.work.undone.get(episode.policy)
        run = prepared(policy, clip, play.effects, episode.seed, limits, undone)
        rows = records_of(run, run.entries())
        try:
            made.append(rollout_of(_about(episode, policy, undone), rows))
        except BadInput as few:
            if few.where != episode.rollout_id:
                raise
            print(f"{few.where}: nothing measured, the rule {run.guard.reason} ended it", flush=True)
        else:
            made[-1].meta.update(episode.meta)
        play.tick(clip.frames)
    if not made:
        raise BadInput("stand-in robot over a wire", "one run in which the policy carries it", "none")
    return made


def prepared(
    policy: ExportedPolicy,
    clip: Clip,
    effects: Sequence[Json],
    seed: int,
    limits: Limits = Limits(),  # noqa: B008  (frozen)
    undone: Compensation | None = None,
) -> Rehearsal:
    """A run before it begins."""
    brain = Brain(policy, clip, undone)
    robot = WireRobot(effects, RobotSettings(seed=seed, states=LINE, orders=LINE), 0)
    every, numbers = round(ORDER_HZ / float(policy.contract["control_hz"])), numbers_for(policy.sensors)
    plan = Plan(7, robot.card.robot, every, clip.frames, brain.hold(), numbers, True, limits, QUICK)
    run = Rehearsal(robot, brain, plan, drives_of(policy.contract))
    run.longest += clip.frames / clip.fps
    return run


def records_of(run: Rehearsal, entries: Iterable[Entry]) -> np.ndarray:
    """Records of a journal of these entries of a run."""
    joints = len(run.robot.card.joints)
    return np.frombuffer(b"".join(record(entry, joints) for entry in entries), layout(joints))


def _about(episode: Episode, policy: ExportedPolicy, undone: Compensation | None) -> dict[str, object]:
    about: dict[str, object] = {
        "id": episode.rollout_id,
        "robot": ROBOT,
        "joints": list(policy.contract["joints"]),
        "control_hz": float(policy.contract["control_hz"]),
        "motion": episode.motion,
        "policy": {"name": episode.policy, "version": "", "sha256": policy.sha256},
    }
    return about if undone is None else about | {"compensation": undone.sha256}


if __name__ == "__main__":
    raise SystemExit(main(robot=over_wire))
