"""A small run of the real policy on the simulated robot, in the time of its messages."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bumblebee.learning.export import export_shipped
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.wire.plan import Plan
from bumblebee.wire.policy_end.brain import Brain
from bumblebee.wire.rehearsal import Rehearsal
from bumblebee.wire.robot_end.robot import RobotSettings, WireRobot
from bumblebee.wire.safety.intake import numbers_for
from bumblebee.wire.safety.limits import drives_of
from bumblebee.wire.safety.phases import Ramps
from tests.policy.conftest import nod

SHORT = Ramps(rise_speed=5.0, rise_least=0.6, soften=0.2, ready=0.1, blend=0.2, stand=0.04, damp=0.1)


@pytest.fixture(scope="session")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> ExportedPolicy:
    return ExportedPolicy.load(export_shipped(tmp_path_factory.mktemp("shipped") / "policy"))


@pytest.fixture
def rehearsal(shipped: ExportedPolicy) -> Callable[..., Rehearsal]:
    """Makes a run of a clip of half a second; what is given changes the robot's settings."""

    def make(
        effects: list[dict[str, Any]] | None = None,
        frames: int = 25,
        policy: ExportedPolicy = shipped,
        **settings: Any,
    ) -> Rehearsal:
        clip, values = nod(frames=frames), {"state_hz": 250, "noise": 0.0} | settings
        brain, robot = Brain(policy, clip), WireRobot(effects or [], RobotSettings(**values), 0)
        plan = Plan(
            7, robot.card.robot, 4, clip.frames, brain.hold(), numbers_for(policy.sensors), unattended=True, ramps=SHORT
        )
        return Rehearsal(robot, brain, plan, drives_of(policy.contract))

    return make


@pytest.fixture
def policy_path(shipped: ExportedPolicy) -> Path:
    return shipped.folder
