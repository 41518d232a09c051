"""Geometries far above the floor are left out of collisions for as long as a simulation runs, and change nothing."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.simulation import simulate
from bumblebee.diagnosis.simulation.collision_culling import out_of_reach, without
from bumblebee.diagnosis.simulation.simulate import residuals
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.diagnosis.simulation.windows import Windows, choose_starts, cut
from tests.diagnosis import stander

_FLOOR, _BALL = 'contype="1" conaffinity="2"', 'contype="2" conaffinity="1"'


def _xml(ball: str = _BALL, height: float = 0.9) -> str:
    """The stander with a ball `height` m above its trunk; its feet cannot touch the ball."""
    named = stander.XML.replace('<geom name="floor"', f'<geom name="floor" {_FLOOR}')
    named = named.replace('<geom type="sphere"', f'<geom {_BALL} type="sphere"')
    return named.replace(
        '<body name="arm"', f'<geom name="head" {ball} mass="0" size=".05" pos="0 0 {height}"/><body name="arm"'
    )


def _made(xml: str, span: float = 0.2) -> tuple[Session, Windows]:
    rollouts, _ = stander.simulate(seconds=3.0)
    session = make_session(mujoco.MjSpec.from_string(xml), rollouts, "stander", "memory")
    starts = choose_starts(session.rollouts, [0, 1], span, 6)
    return session, cut(session.plant, session.layout, session.rollouts, starts)


def test_a_head_is_out_of_reach_and_feet_are_not() -> None:
    session, windows = _made(_xml())
    assert out_of_reach(session.plant, windows).tolist() == [session.plant.model.geom("head").id]


@pytest.mark.parametrize(
    ("xml", "span"),
    [
        (_xml(height=0.3), 0.2),  # so low that it could come down
        (_xml(), 1.0),  # so long that it could fall
        (_xml('contype="3" conaffinity="3"'), 0.2),  # the feet could touch it
        (_xml().replace('type="plane" size="5 5 .1"', 'type="box" size="5 5 .1" pos="0 0 -.1"'), 0.2),
        (_xml().replace('type="plane"', 'type="plane" euler="0 .01 0"'), 0.2),
    ],
)
def test_what_might_touch_something_stays(xml: str, span: float) -> None:
    session, windows = _made(xml, span)
    assert out_of_reach(session.plant, windows).size == 0


def test_residuals_are_the_same_to_the_bit_and_models_as_they_were(monkeypatch: pytest.MonkeyPatch) -> None:
    session, windows = _made(_xml())
    variation = vary(session.plant, [])
    kinds = variation.model.geom_contype.copy()
    found = residuals(session.plant, session.layout, windows, [variation], 0.005)
    assert np.array_equal(variation.model.geom_contype, kinds)
    monkeypatch.setattr(simulate, "out_of_reach", lambda plant, windows: np.empty(0, dtype=int))
    assert np.array_equal(found, residuals(session.plant, session.layout, windows, [variation], 0.005))


def test_collisions_come_back_after_an_error() -> None:
    model = mujoco.MjModel.from_xml_string(_xml())
    kinds, affinities = model.geom_contype.copy(), model.geom_conaffinity.copy()
    with pytest.raises(RuntimeError), without([model], np.array([1, 2])):
        assert not model.geom_contype[1:3].any() and not model.geom_conaffinity[1:3].any()
        raise RuntimeError
    assert np.array_equal(model.geom_contype, kinds) and np.array_equal(model.geom_conaffinity, affinities)
