"""True robots started again in the middle: exact where the readings say all, a guess where they do not."""

import numpy as np
import pytest

from benchmarks.undeclared.detectable import chi_square, make_eye
from benchmarks.undeclared.excite import HZ, make_plan
from benchmarks.undeclared.flight import fly
from benchmarks.undeclared.resume import resumed
from benchmarks.undeclared.robots import declared
from bumblebee.stand_in.undeclared.bodies import Slope
from bumblebee.stand_in.undeclared.drives import Drift, Fade, TorqueLag
from bumblebee.stand_in.undeclared.friction import Coulomb, Hysteresis
from bumblebee.stand_in.undeclared.gears import Backlash, Elastic
from bumblebee.stand_in.undeclared.law import Seen
from bumblebee.stand_in.undeclared.outside import DwellFriction, LooseMount, RateLimit
from bumblebee.stand_in.undeclared.signals import CommandDelay, DroppedCommands, EncoderDelay, EncoderOffset

ARM = declared("arm")
PICKS = np.array([(0, 12), (2, 30), (1, 30), (2, 47)])
AHEAD = 4  # ticks
KNOWN = [
    TorqueLag("elbow", 0.01), Fade("lift", 120.0, 0.8), Drift("lift", 0.1), CommandDelay("yaw", 0.0123),
    DroppedCommands(0.3), EncoderDelay("elbow", 0.0074), EncoderOffset("roll", 0.05), Hysteresis("lift", 4.0),
    Coulomb("yaw", 2.0), DwellFriction("yaw", 4.0), RateLimit("lift", 0.3), Slope(0, 0.05),
]  # fmt: skip


def _fly(law, seconds=1.3):
    return fly(ARM, [law], make_plan(ARM, 3, seconds, np.random.default_rng(4)), np.random.default_rng(1))


def _seen(flight):
    r, k = PICKS.T
    acceleration = (flight.qvel[k + 1, r] - flight.qvel[k - 1, r]) * HZ / 2
    growth = (flight.torque[k + 1, r] - flight.torque[k - 1, r]) * HZ / 2
    return Seen(ARM.joints, flight.qpos[k, r], flight.qvel[k, r], flight.torque[k, r], growth, acceleration)


def _gone_on(flight):
    """Readings (W, J) that robots started again have later, and those that the flight had."""
    r, k = PICKS.T
    state = flight.own_qpos[k, r], flight.own_qvel[k, r]
    robots = resumed(ARM, flight.laws, PICKS, state, _seen(flight), k / HZ)
    for ahead in range(AHEAD):
        robots.hold(flight.arrived[k + ahead, r])
    return robots.state()[0], flight.qpos[k + AHEAD, r]


@pytest.mark.parametrize("law", KNOWN, ids=lambda law: type(law).__name__)
def test_what_readings_and_commands_determine_goes_on_as_it_was(law):
    again, was = _gone_on(_fly(law))
    assert np.abs(again - was).max() < 1e-6


@pytest.mark.parametrize("law", [Elastic("elbow", 3000.0, True), Elastic("elbow", 3000.0), LooseMount(5000.0)])
def test_a_guessed_state_is_near_the_true_one_but_not_it(law):
    again, was = _gone_on(_fly(law))
    assert 1e-7 < np.abs(again - was).max() < 5e-3


@pytest.mark.parametrize("on_motor", [False, True])
def test_play_is_guessed_to_touch_where_the_torque_points(on_motor):
    flight = _fly(Backlash("lift", 0.01, on_motor))
    r, k = PICKS.T
    state = flight.own_qpos[k, r], flight.own_qvel[k, r]
    robots = resumed(ARM, flight.laws, PICKS, state, _seen(flight), k / HZ)
    law = robots.laws[0]
    np.testing.assert_array_equal(law._side, np.sign(_seen(flight).through("lift", law._rotor)))
    np.testing.assert_allclose(robots.state()[0], flight.qpos[k, r], atol=1e-12)  # it reads what was read


def test_shorter_steps_of_the_truth_are_no_effect():
    plan = make_plan(ARM, 2, 2.0, np.random.default_rng(0))
    eye = make_eye(ARM, fly(ARM, [], plan, np.random.default_rng(1)), 1.0, np.random.default_rng(2))
    law = EncoderOffset("roll", 0.0)
    law.parts = 4
    assert chi_square(eye, fly(ARM, [law], plan, np.random.default_rng(1))) < 0.1


def test_what_not_even_the_true_law_explains_counts_for_nothing():
    plan = make_plan(ARM, 2, 2.0, np.random.default_rng(0))
    eye = make_eye(ARM, fly(ARM, [], plan, np.random.default_rng(1)), 1.0, np.random.default_rng(2))
    flight = fly(ARM, [Backlash("yaw", 0.02, True)], plan, np.random.default_rng(1))
    assert chi_square(eye, flight) > 100.0
    lost = [tuple(Backlash("yaw", 0.0, True) for _ in moment) for moment in flight.laws]
    for moment in lost:
        for law in moment:
            law._armature, law._rotor = 0.03, 0.027
            law._side, law._play, law._speed, law._last = (np.zeros(2) for _ in range(4))
    blind = type(flight)(*(getattr(flight, f) for f in flight.__dataclass_fields__ if f != "laws"), tuple(lost))
    assert chi_square(eye, blind) < 0.5 * chi_square(eye, flight)
