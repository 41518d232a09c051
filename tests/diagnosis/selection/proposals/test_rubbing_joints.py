"""Where many joints have friction those are asked for more of it that lack most torque."""

from types import SimpleNamespace

import pytest

from bumblebee.diagnosis.config import SearchConfig
from bumblebee.diagnosis.selection.proposals import rubbing_joints
from bumblebee.diagnosis.thresholds import Thresholds

WORST_FIRST = ["base", "j7", "bare", "j2", "j5", "j0"]


@pytest.mark.parametrize(("joints", "asked"), [(3, ["j0", "j1", "j2"]), (12, ["j7", "j2"])])
def test_of_many_joints_with_friction_the_worst_are_asked(
    monkeypatch: pytest.MonkeyPatch, joints: int, asked: list[str]
) -> None:
    monkeypatch.setattr(rubbing_joints, "restless", lambda small, white, left, count: WORST_FIRST[:count])
    run = SimpleNamespace(
        problem=SimpleNamespace(thresholds=Thresholds(), plant=SimpleNamespace(joints=[""] * 30)),
        white=None,
        small=None,
        small_fit=lambda: SimpleNamespace(clean=lambda problem: None),
        config=SearchConfig(),
    )
    assert rubbing_joints.worth_asking(run, [f"j{k}" for k in range(joints)]) == asked
