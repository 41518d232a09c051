"""States of discovered terms: by the engine's steps, by the log, and by an independent integration."""

import numpy as np
import pytest

from bumblebee.sim.effects import State, read_term, states_of

REST, SLEW = State(0, "rested(0.3, 0.02)", (0.3, 0.02)), State(0, "slewed(2, 0.02)", (2.0, 0.02))


def test_rest_grows_and_motion_wears_it_off_as_the_equation_says() -> None:
    rng, step = np.random.default_rng(0), 1e-3
    speed = np.where(np.arange(2000) % 700 < 400, 0.0, rng.uniform(-1, 1, 2000))
    now, fine = np.zeros(1), 0.0
    for v in speed:
        now = REST.after(REST.at(now, np.zeros(1), np.zeros(1), step), np.array([v]), step)
        for _ in range(50):
            fine += (step / 50) * ((1 - fine) / 0.3 - fine * abs(v) / 0.02)
    assert now[0] == pytest.approx(fine, abs=2e-3)


def test_a_limited_target_moves_once_a_tick_and_never_faster() -> None:
    step, ticks = 0.005, 50
    target = np.repeat(np.sign(np.sin(np.arange(ticks))) * 0.3, 4)
    now, seen = SLEW.first(target[:1]), []
    for k, u in enumerate(target):
        now = SLEW.at(now, np.array([u]), np.array([k * step]), step)
        seen.append(now[0])
    by_hand, out = target[0], []
    for u in target[::4]:
        by_hand += np.clip(u - by_hand, -0.04, 0.04)
        out += [by_hand] * 4
    np.testing.assert_allclose(seen, out, atol=1e-12)


@pytest.mark.parametrize("state", [REST, SLEW])
def test_a_log_followed_at_its_ticks_is_the_same_as_steps(state: State) -> None:
    rng = np.random.default_rng(1)
    clock, steps = np.arange(100) * 0.02, np.full(100, 0.02)
    v, u = rng.standard_normal(100), np.cumsum(0.05 * rng.standard_normal(100))
    now, seen = state.first(u[:1]), []
    for k in range(100):
        seen.append(float(now[0]))
        now = state.after(state.at(now, u[k : k + 1], clock[k : k + 1], 0.02), v[k : k + 1], 0.02)
    np.testing.assert_allclose(state.followed(clock, steps, v, u), seen, atol=1e-9)


@pytest.mark.parametrize("state", [REST, SLEW])
def test_logs_followed_side_by_side_are_each_alone(state: State) -> None:
    rng = np.random.default_rng(2)
    clock, steps = np.arange(100) * 0.02 + rng.random((3, 1)), np.full((3, 100), 0.02)
    v, u = rng.standard_normal((3, 100)), np.cumsum(0.05 * rng.standard_normal((3, 100)), axis=1)
    together = state.followed(clock, steps, v, u)
    for k in range(3):
        np.testing.assert_allclose(together[k], state.followed(clock[k], steps[k], v[k], u[k]), atol=1e-12)


def test_terms_that_share_a_state_keep_it_once() -> None:
    terms = [(0, 1.0, read_term("friction(rested(0.3, 0.02))")), (0, 2.0, read_term("v*rested(0.3, 0.02)"))]
    assert states_of(terms) == [REST]
