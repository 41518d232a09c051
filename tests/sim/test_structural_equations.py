"""Play, flexible shafts and hysteresis against the same equations integrated in NumPy."""

from collections.abc import Callable

import numpy as np
import pytest

from bumblebee.sim.effects import single
from tests.sim.hinge import ARM, FINE, INERTIA, MASS, both, check, model_with, path, reference, servo, swing


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
