"""Drives that follow their targets late are told from delays and from lost commands; whole diagnoses of the arm."""

from dataclasses import replace
from functools import cache

import pytest

from bumblebee.diagnosis.diagnose import Diagnosis, diagnose
from tests.diagnosis import arm
from tests.diagnosis.setpoint_arm import filtered, late, limited, losing, profiled, simulate

DRIVES = {
    "filter": filtered(1, 0.03),
    "rate": limited(1, 1.0),
    "profile": profiled(1, 30.0, 2.0),
    "loss": losing(1, 0.3),
    "loss of all": losing(None, 0.3),
    "delay": late(1, 0.025),
}


@cache
def diagnosis(drive: str) -> Diagnosis:
    config = replace(arm.SMALL, max_windows=40, max_holdout_windows=20) if drive == "profile" else arm.SMALL
    return diagnose(arm.session_of(simulate(DRIVES[drive])), config)


@pytest.mark.parametrize(
    ("drive", "effect", "where", "parameter", "truth"),
    [
        pytest.param("filter", "command_filter", ["j2"], "time", 0.03, marks=pytest.mark.slow),
        pytest.param("rate", "command_rate_limit", ["j2"], "rate", 1.0, marks=pytest.mark.slow),
        pytest.param("profile", "command_profile", ["j2"], "acceleration", 30.0, marks=pytest.mark.slow),
        ("loss", "dropped_commands", ["j2"], "share", 0.3),
        pytest.param("loss of all", "dropped_commands", [], "share", 0.3, marks=pytest.mark.slow),
        pytest.param("delay", "command_delay", ["j2"], "delay", 0.025, marks=pytest.mark.slow),
    ],
)
def test_the_drive_is_named_alone_and_its_size_is_in_the_interval(
    drive: str, effect: str, where: list[str], parameter: str, truth: float
) -> None:
    effects = diagnosis(drive).document["effects"]
    assert [(e["effect"], e["where"]) for e in effects] == [(effect, where)]
    found = effects[0]["parameters"][parameter]
    low, high = found["ci95"]
    assert low <= truth <= high or abs(found["value"] / truth - 1) < 0.01
