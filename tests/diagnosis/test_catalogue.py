"""Effects beyond the usual ones, from truths with equations of their own: named up to their class, with their size."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.selection.proposals.encoder_resolution import grids
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds
from bumblebee.sim.effects import CATALOGUE
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import simulate

CONFIG = replace(arm.SMALL, beyond=False)
CASES = [
    ("command_delay", "", (0.012,), "delay", 0.06),
    pytest.param("strength_drift", "j2", (0.04,), "rate", 0.1, marks=pytest.mark.slow),
    pytest.param("cogging", "j1", (0.3, 0.2, 12.0), "periods", 0.01, marks=pytest.mark.slow),
    pytest.param("hysteresis", "j2", (0.5, 0.05), "amplitude", 0.1, marks=pytest.mark.slow),
    pytest.param("backlash", "j2", (0.03,), "gap", 0.25, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("kind", "place", "values", "parameter", "tolerance"), CASES)
def test_an_effect_is_named_up_to_its_class(
    kind: str, place: str, values: tuple[float, ...], parameter: str, tolerance: float
) -> None:
    """The first in the list is the effect, or lists it as the same to these data; searched at 1 ms.

    Tolerances are above the scatter between seeds: a delay of 12 ms comes with an interval of 1 ms to either side.
    """
    rollouts = simulate({(kind, place): values}, seed=5)
    found = diagnose(arm.session_of(rollouts, thresholds=DatasetThresholds()), CONFIG).document["effects"]
    same = [(e["effect"], e["where"]) for e in (found[0], *found[0]["equivalent"])]
    assert (kind, [place] if place else []) in same
    if found[0]["effect"] == kind:
        truth = values[CATALOGUE[kind].names.index(parameter)]
        assert found[0]["parameters"][parameter]["value"] == pytest.approx(truth, rel=tolerance)


@pytest.mark.slow
def test_hysteresis_is_found_on_a_joint_with_a_declared_spring() -> None:
    """MJCF has one spring a joint, so only Dahl's law can be named there; the truth yields at a width."""
    declared = arm.XML.replace('<joint name="j2"', '<joint name="j2" stiffness="5"')
    rollouts = simulate({("joint_spring", "j2"): (5.0, 0.0), ("hysteresis", "j2"): (0.8, 0.05)}, seed=5)
    found = diagnose(arm.session_of(rollouts, declared), CONFIG).document["effects"][0]
    assert (found["effect"], found["where"], found["parameters"]["dahl"]["value"]) == ("hysteresis", ["j2"], 1.0)
    assert found["parameters"]["amplitude"]["value"] == pytest.approx(0.8, rel=0.4)


@pytest.mark.parametrize("noise", [0.0, 4e-4, 8e-4])
def test_an_encoders_steps_are_seen_in_its_readings(noise: float) -> None:
    """The grid is found with its step, with noise on top as well; a smooth reading has none."""
    rng = np.random.default_rng(0)
    smooth = arm.simulate({}, count=2, seconds=3.0)
    assert grids(smooth) == []
    steps = np.array([0.004, 0.0, 0.0])
    rounded = []
    for rollout in smooth:
        q = rollout.joint_pos.copy()
        q[:, 0] = np.round(q[:, 0] / steps[0]) * steps[0] + noise * rng.standard_normal(len(q))
        rounded.append(replace(rollout, joint_pos=q))
    (found,) = grids(rounded, noise=[max(noise, 1e-4)] * 3)
    assert found.joint == "j1"
    assert found.step == pytest.approx(0.004, abs=max(4 * found.error, 1e-9))


def test_a_motion_that_comes_back_to_the_same_places_is_no_grid() -> None:
    """It prefers some angles by far more than its readings' noise leaves open; without the noise none can tell."""
    rng = np.random.default_rng(0)
    places = 0.145 * rng.integers(-10, 11, 1200)[:, None] + 0.02 * rng.standard_normal((1200, 3))
    (rollout,) = arm.simulate({}, count=1, seconds=1.0)
    time, rest = np.arange(1200) / 50, np.zeros((1200, 3))
    readings = [replace(rollout, time=time, joint_pos=places, joint_vel=rest, joint_target=rest)]
    assert len(grids(readings)) == 3
    assert grids(readings, noise=[1e-3] * 3) == []


@pytest.mark.parametrize("travel", [0.0099, 0.01001, 0.01005, 0.0102])
def test_a_joint_that_hardly_travels_has_no_grid(travel: float) -> None:
    (rollout,) = arm.simulate({}, count=1, seconds=1.0)
    turn = np.linspace(0.0, travel, len(rollout.time))
    assert grids([replace(rollout, joint_pos=np.stack([turn] * 3, axis=1))]) == []
