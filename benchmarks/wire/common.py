"""The shipped policy, the embedded motions, and a run of both in the time of their messages."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.deploy.policy import ExportedPolicy
from bumblebee.learning.export import export_shipped
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make
from bumblebee.motion.embedded.kinds import kinds
from bumblebee.wire.brain import Brain
from bumblebee.wire.intake import numbers_for
from bumblebee.wire.journal import layout, record
from bumblebee.wire.limits import drives_of
from bumblebee.wire.line import LineFaults
from bumblebee.wire.phases import Ramps
from bumblebee.wire.plan import Plan
from bumblebee.wire.rehearsal import Rehearsal
from bumblebee.wire.robot import RobotSettings, WireRobot

SHORT = Ramps(rise_speed=5.0, rise_least=0.5, soften=0.2, ready=0.2, blend=0.5, stand=0.02, damp=0.1)
LINE = LineFaults(delay=0.001, jitter=0.0005)


def shipped() -> ExportedPolicy:
    return ExportedPolicy.load(export_shipped(Path(tempfile.mkdtemp()) / "shipped"))


def clips(names: list[str]) -> list[Clip]:
    return [make(kind, 0, EmbeddedConfig()) for kind in kinds() if not names or kind.name in names]


def rehearsed(policy: ExportedPolicy, clip: Clip, effects: list[dict[str, Any]], seed: int) -> tuple[Rehearsal, Any]:
    """A run, and its journal's records."""
    brain, robot = Brain(policy, clip), WireRobot(effects, RobotSettings(seed=seed, states=LINE, orders=LINE), 0)
    plan = Plan(
        7, robot.card.robot, 4, clip.frames, brain.hold(), numbers_for(policy.sensors), unattended=True, ramps=SHORT
    )
    run = Rehearsal(robot, brain, plan, drives_of(policy.contract))
    return run, np.frombuffer(b"".join(record(entry, 23) for entry in run.entries()), layout(23))
