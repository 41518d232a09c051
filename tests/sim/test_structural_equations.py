"""Play, flexible shafts and hysteresis against the same equations integrated in NumPy."""

from collections.abc import Callable

import numpy as np
import pytest

from bumblebee.effects.native import NO_SURFACE, POINT_RADIUS
from bumblebee.sim.effects import single
from tests.sim.hinge import ARM, FINE, INERTIA, MASS, TOTAL, both, check, model_with, path, reference, servo, swing


def test_hysteresis_is_a_spring_that_yields() -> None:
    centre = [0.0]

    def torque(t: float, q: float, v: float) -> float:
        centre[0] = min(max(centre[0], q - 0.05), q + 0.05)
        return servo(t, q, v) - 1.2 * (q - centre[0]) / 0.05

    check([single("hysteresis", "j", 1.2, 0.05)], reference(torque))


def two_masses(between: Callable[[float, float], float], seconds: float = 0.4, encoder: int = 0) -> np.ndarray:
    """Rotor (INERTIA) under the servo, link (MASS ARM^2), `between(angle, speed)` pulls the rotor to the link.

    The encoder, which the servo hears, reads the rotor (0) or the link (1).
    """
    q, v, out = np.zeros(2), np.zeros(2), []
    step = FINE / 5
    for k in range(round(seconds / step)):
        pull = between(q[1] - q[0], v[1] - v[0])
        v += step * np.array([(servo(k * step, q[encoder], v[encoder]) + pull) / INERTIA, -pull / (MASS * ARM**2)])
        q += step * v
        if (k + 1) % round(0.001 / step) == 0:
            out.append((q[encoder], v[encoder]))
    return np.array(out)


def test_a_flexible_shaft_is_a_second_mass_on_a_spring() -> None:
    model = model_with(single("series_elasticity", "j", 60.0))
    assert model.nq == 2 and model.key("up").qpos.tolist() == [0.1, 0.0]
    check([single("series_elasticity", "j", 60.0)], two_masses(lambda d, w: 60.0 * d + 0.06 * w), share=0.1)


def test_a_flexible_shaft_before_the_encoder_is_one_too() -> None:
    effect = single("series_elasticity", "j", 60.0, 1.0)
    model = model_with(effect)
    assert model.nq == 2 and model.key("up").qpos.tolist() == [0.1, 0.0]
    wanted = two_masses(lambda d, w: 60.0 * d + 0.06 * w, encoder=1)
    assert np.abs(wanted - two_masses(lambda d, w: 60.0 * d + 0.06 * w)).max() > 0.01  # not the same motion
    check([effect], wanted, share=0.1)


def test_hysteresis_by_dahls_law_follows_its_equation() -> None:
    z = np.zeros(1)

    def torque(t: float, q: float, v: float) -> float:
        z[0] += FINE * v / 0.05 * (1 - np.sign(v) * z[0])
        return servo(t, q, v) - 0.4 * z[0]

    check([single("hysteresis", "j", 0.4, 0.05, 1.0)], reference(torque), share=0.1)


@pytest.mark.parametrize("degrees", [False, True])
def test_play_leaves_the_link_free_between_its_ends(degrees: bool) -> None:
    """A hard spring outside the gap stands for the ends in the reference."""

    def between(d: float, w: float) -> float:
        over = d - np.clip(d, -0.05, 0.05)
        return 2e4 * over + (20.0 * w if over else 0.0)

    model = model_with(single("backlash", "j", 0.1), degrees=degrees)
    np.testing.assert_allclose(model.joint("j_play").range, [-0.05, 0.05], atol=1e-9)
    mine = path([single("backlash", "j", 0.1)], swing, degrees=degrees)
    plain, without = both()
    change = (two_masses(between) - without)[:150, 0]  # impacts are as sharp as their solver: positions only
    assert np.abs((mine - plain)[:150, 0] - change).max() < 0.1 * np.abs(change).max()


def test_a_backlash_of_no_width_is_a_model_all_the_same() -> None:
    """As a fit leaves one that is not there."""
    model = model_with(single("backlash", "j", 0.0))
    low, high = model.joint("j_play").range
    assert low < high and high - low < 1e-6


def test_a_surface_stops_the_point_that_touches_it() -> None:
    """The point is at the end of the arm; where it would sink in, the hinge stands instead, and loses its speed."""
    height, friction = -0.06, 0.0
    most = np.arcsin((-height - POINT_RADIUS) / ARM)
    q, v, out = 0.0, 0.0, []
    for k in range(round(0.4 / FINE)):
        v += FINE * servo(k * FINE, q, v) / TOTAL
        q += FINE * v
        if q > most:
            q, v = most, min(v, 0.0)
        if (k + 1) % round(0.001 / FINE) == 0:
            out.append((q, v))
    assert (np.array(out)[:, 0] == most).sum() > 30  # ms that it stands
    effect = single("surface_contact", "link", height, ARM, 0.0, 0.0, friction)
    mine, (plain, without) = path([effect], swing), both()
    assert np.abs(np.array(out) - without).max(axis=0)[0] > 0.1
    away = np.abs(mine[:, 0] - np.array(out)[:, 0])  # a contact of MuJoCo's gives way by millimetres
    assert away.mean() < 0.012 and away.max() < 0.03
    assert np.abs(plain - mine)[:, 0].max() > 0.1


def test_a_surface_touches_nothing_but_its_point_and_a_low_one_nothing() -> None:
    effect = single("surface_contact", "link", NO_SURFACE, ARM, 0.0, 0.0, 1.0)
    np.testing.assert_array_equal(path([effect], swing), both()[0])
    model = model_with(single("surface_contact", "link", 0.0, ARM, 0.0, 0.0, 0.4))
    assert model.geom_contype.tolist() == model.geom_conaffinity.tolist() == [0, 0]
    assert model.npair == 1 and model.pair_friction[0, 0] == 0.4
    assert model.body("link").mass == model_with().body("link").mass
