"""Set-points along windows that start mid-trajectory: as if the drive had been simulated since the rollout began."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.simulation.inputs import inputs_of
from bumblebee.diagnosis.simulation.starts.setpoints import (
    _at_first_command,
    _filtered,
    _followed,
    _paths,
    begin_setpoints,
    setpoints_of,
)
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.sim.effects import Effect, advance, single
from tests.diagnosis import arm
from tests.diagnosis.setpoint_arm import Drive, filtered, limited, profiled, simulate

STEP, TICK = 0.001, 20
KINDS = [
    (single("command_filter", "j2", 0.06), filtered(1, 0.06)),
    (single("command_rate_limit", "j2", 0.7), limited(1, 0.7)),
    (single("command_profile", "j2", 15.0, 1.0), profiled(1, 15.0, 1.0)),
]


@pytest.mark.parametrize(("effect", "drive"), KINDS)
def test_a_window_begins_where_the_targets_before_it_have_brought_the_set_point(effect: Effect, drive: Drive) -> None:
    """A drive stepped by the millisecond from the rollout's first target on, within what its steps leave open."""
    session = arm.session_of(simulate(drive, count=2, seconds=3.0))
    plant = session.plant
    windows = cut(plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 20))
    count = round(windows.span / STEP)
    mine = inputs_of(windows, vary(plant, [effect]), STEP, count, {})
    told = inputs_of(windows, vary(plant, []), STEP, count, {})
    worst = []
    for w, (i, k) in enumerate(zip(windows.rollout, windows.start, strict=True)):
        path = drive(np.repeat(session.rollouts[i].joint_target, TICK, axis=0), np.random.default_rng(0))[:, 1]
        worst.append(np.abs(mine[w, :, 1] - path[k * TICK : k * TICK + count]).max())
    away = np.abs(mine - told)
    assert max(worst) < 0.06 * away[..., 1].max() and away[..., 1].max() > 0.02
    assert not away[..., [0, 2]].any()


@pytest.mark.parametrize(("effect", "drive"), KINDS)
def test_a_late_set_point_is_the_same_later(effect: Effect, drive: Drive) -> None:
    session = arm.session_of(simulate(drive, count=1, seconds=2.0))
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, 5))
    prompt = inputs_of(windows, vary(session.plant, [effect]), STEP, 150, {})
    late = inputs_of(windows, vary(session.plant, [effect, single("command_delay", "j2", 0.03)]), STEP, 150, {})
    np.testing.assert_allclose(late[:, 30:, 1], prompt[:, :-30, 1], atol=1e-9)


@pytest.mark.parametrize(("effect", "drive"), KINDS)
def test_closed_forms_in_one_step_are_those_in_many(effect: Effect, drive: Drive) -> None:
    """Place, speed and integral after 0.3 s, from anywhere to anywhere."""
    rng = np.random.default_rng(0)
    at, target = rng.normal(size=(2, 200))
    speed = rng.uniform(-1, 1, 200) * (effect.effect == "command_profile")
    whole = advance(effect.effect, effect.values(), at, speed, target, 0.3)
    area = np.zeros(200)
    for _ in range(100):
        grown, at, speed = advance(effect.effect, effect.values(), at, speed, target, 0.003)
        area += grown
    for mine, other in zip(whole, (area, at, speed), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-9)


def test_a_joint_without_a_drive_has_no_set_point() -> None:
    xml = arm.XML.replace('<position name="j3" joint="j3" kp="30" kv="2" forcerange="-20 20"/>', "")
    plant = arm.session_of(simulate(filtered(0, 0.01), count=1, seconds=1.0), xml).plant
    assert [p.column for p in setpoints_of(plant, [single("command_filter", "", 0.03)])] == [0, 1]


@pytest.mark.parametrize(("effect", "drive"), KINDS)
def test_a_long_rollout_followed_in_parts_is_the_same(effect: Effect, drive: Drive) -> None:
    """Parts of 10 s, each begun 10 s earlier, to 10 mrad where the drive lags behind nearly all the time."""
    session = arm.session_of(simulate(drive, count=2, seconds=24.0))
    (point,) = setpoints_of(session.plant, [effect])
    whole = _paths(session.rollouts, [replace(point, memory=100.0)])
    parts = _paths(session.rollouts, [replace(point, memory=10.0)])
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_allclose(one, other, atol=0.01)


@pytest.mark.parametrize(("effect", "drive"), KINDS)
def test_many_set_points_at_once_begin_where_each_does(effect: Effect, drive: Drive) -> None:
    session = arm.session_of(simulate(drive, count=2, seconds=4.0))
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 8))
    (name, *rest), (size, *others) = effect.parameters, effect.values()
    sizes = [{name: share * size, **dict(zip(rest, others, strict=True))} for share in (0.5, 1.0, 2.0)]
    points = [
        p
        for joint, own in zip(arm.JOINTS, sizes, strict=True)
        for p in setpoints_of(session.plant, [replace(effect, where=(joint,), parameters=own)])
    ]
    begin_setpoints(windows, points)
    for point in points:
        alone = replace(windows, span=windows.span)  # others by name, so that nothing is known of them
        for together, by_itself in zip(_at_first_command(windows, point), _at_first_command(alone, point), strict=True):
            np.testing.assert_allclose(together, by_itself, rtol=0, atol=1e-12)
    moved = np.stack([_at_first_command(windows, point)[0] for point in points])
    assert np.abs(moved - [windows.command[:, 0, p.actuator] / p.scale for p in points]).max() > 1e-3


@pytest.mark.parametrize("time", [1e-4, 0.03, 5.0])
def test_a_filter_over_spans_is_the_one_that_goes_tick_by_tick(time: float) -> None:
    """Uneven stamps, a part that ends early, a filter faster than a tick and one slower than the rollout."""
    rng = np.random.default_rng(0)
    command, lasts = rng.standard_normal((2, 3, 700)), rng.uniform(0.0005, 0.004, (3, 700))
    lasts[1, 400:] = 0.0
    constant = np.array([[time], [2.0 * time]])
    expected = _followed("command_filter", [constant], command, lasts)[..., 0]
    np.testing.assert_allclose(_filtered(constant, command, lasts), expected, rtol=0, atol=1e-12)
