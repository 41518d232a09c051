"""Ground reactions are unknown: torques are told beside them."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset import Session, make_session
from bumblebee.diagnosis.sensitivities.ground import basis_of, pushes, without, without_push
from bumblebee.diagnosis.thresholds.sensitivities import Ground
from tests.diagnosis import arm, stander


@pytest.fixture(scope="module")
def session() -> Session:
    rollouts, _ = stander.simulate(count=2, seconds=1.0)
    return make_session(mujoco.MjSpec.from_string(stander.XML), rollouts, "stander", "x")


def _poses(session: Session, *heights: float) -> np.ndarray:
    qpos = np.tile(session.plant.model.qpos0, (1, len(heights), 1))
    qpos[0, :, 2] = heights
    return qpos


def test_a_trunk_on_its_feet_may_be_pushed_and_one_in_the_air_may_not(session: Session) -> None:
    ground = pushes(session.plant, _poses(session, 0.2, 0.5), Ground())
    assert ground.shape == (1, 2, 7, 6)
    assert np.linalg.matrix_rank(ground[0, 0]) == 6 and not ground[0, 1].any()
    assert pushes(session.plant, _poses(session, 0.5), Ground()).shape[-1] == 0
    assert pushes(session.plant, _poses(session, 0.23), Ground()).shape[-1] == 0
    assert pushes(session.plant, _poses(session, 0.23), Ground(touching=0.04)).shape[-1] == 6


def test_an_arm_that_is_bolted_down_is_not_pushed() -> None:
    fixed = arm.session_of(arm.simulate({}, count=1, seconds=1.0)).plant
    assert pushes(fixed, np.zeros((2, 3, fixed.model.nq)), Ground()).shape == (2, 3, fixed.model.nv, 0)


def test_the_push_takes_what_holds_the_base_and_leaves_the_arm(session: Session) -> None:
    ground = pushes(session.plant, _poses(session, 0.2), Ground())
    model, data = session.plant.model, mujoco.MjData(session.plant.model)
    data.qpos[:], data.qpos[7] = _poses(session, 0.2)[0, 0], 0.4
    mujoco.mj_forward(model, data)
    held = without_push(data.qfrc_bias[None, None], ground, session.plant)[0, 0]
    assert held[:6] == pytest.approx(np.zeros(6), abs=1e-9)
    assert held[6] == pytest.approx(data.qfrc_bias[6]) and abs(held[6]) > 1.0


def test_what_a_push_can_make_is_gone_and_the_rest_stays(session: Session) -> None:
    ground = pushes(session.plant, _poses(session, 0.2), Ground())[0]
    basis = basis_of(ground)
    assert basis[0].T @ basis[0] == pytest.approx(np.eye(6), abs=1e-9)
    assert without(ground, basis) == pytest.approx(np.zeros_like(ground), abs=1e-9)
    swing = np.eye(7)[None, :, 6:]
    assert without(swing, basis) == pytest.approx(swing)
