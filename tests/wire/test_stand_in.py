"""The demo's stand-in behind the guard: the rollouts are those of the guard's journal, by the plan's own rules."""

from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.evaluation.contract import StartNoise
from bumblebee.measured.rollout import read_rollout
from bumblebee.motion.store import write_library
from bumblebee.policy.episodes import Episode
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.stand_in.process import Play, Work, main
from bumblebee.tracking.terminations import Stop
from bumblebee.wire.robot_end.stand_in import over_wire
from tests.policy.conftest import nod


def play(policy: ExportedPolicy, stop: Stop = Stop(), judged: bool = False) -> Play:  # noqa: B008  (frozen)
    episodes = [Episode("one", "p", "nod", 0, {"cluster": "c0"})]
    work = Work({"p": policy.folder}, episodes, StartNoise(), "mocap", {}, stop, judged)
    return Play(work, {"p": policy}, {"nod": nod(frames=10)}, [], 1, lambda count: None)


def test_over_the_wire_a_rollout_has_the_robots_stamps_and_no_place(shipped: ExportedPolicy, tmp_path: Path) -> None:
    write_library(tmp_path / "clips", [nod(frames=10)])
    words = ["--clips", str(tmp_path / "clips"), "--policy", str(shipped.folder), "--names", "nod", "--rollouts", "1"]
    assert main([*words, "--cluster", "c0", "--out", str(tmp_path / "out")], over_wire) == 0
    (path,) = (tmp_path / "out").iterdir()
    rollout = read_rollout(path)
    assert rollout.frames >= 10 and rollout.base_pos is None and rollout.base_lin_vel is not None
    assert (rollout.meta["motion"], rollout.meta["cluster"], rollout.meta["operator"]) == ("nod", "c0", "stand-in")
    assert rollout.meta["notes"].startswith("ran to the end; ") and "stamp to drives" in rollout.meta["notes"]
    assert np.ptp(np.diff(rollout.time)) > 0


def test_where_the_policy_never_carries_the_robot_the_rule_is_said_and_nothing_is_made_up(
    shipped: ExportedPolicy, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(BadInput, match="one run in which the policy carries it, came none"):
        over_wire(play(shipped, Stop(tilt_deg=1e-6, drop_m=1e-6)))
    assert "one: nothing measured, the rule" in capsys.readouterr().out


def test_true_states_are_refused_since_no_wire_carries_them(shipped: ExportedPolicy) -> None:
    with pytest.raises(BadInput, match="true states"):
        over_wire(play(shipped, judged=True))
