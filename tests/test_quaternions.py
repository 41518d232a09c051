"""Quaternions agree with scipy's rotations and do not care for signs."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from bumblebee import quaternions


@pytest.fixture
def quats() -> np.ndarray:
    return Rotation.random(40, random_state=0).as_quat()[:, [3, 0, 1, 2]]


def scipy(quat: np.ndarray) -> Rotation:
    return Rotation.from_quat(quat[:, [1, 2, 3, 0]])


def test_products_and_rotations_are_scipys(quats):
    other = quats[::-1]
    vector = np.random.default_rng(0).normal(size=(40, 3))
    product = (scipy(quats) * scipy(other)).as_matrix()
    np.testing.assert_allclose(scipy(quaternions.multiply(quats, other)).as_matrix(), product, atol=1e-12)
    np.testing.assert_allclose(quaternions.rotate(quats, vector), scipy(quats).apply(vector), atol=1e-12)
    np.testing.assert_allclose(quaternions.rotation_vector(quats), scipy(quats).as_rotvec(), atol=1e-9)


def test_slerp_is_scipys(quats):
    share = np.linspace(0, 1, len(quats) - 1)
    wanted = [Slerp([0, 1], scipy(quats[i : i + 2]))(s).as_matrix() for i, s in enumerate(share)]
    came = scipy(quaternions.slerp(quats[:-1], quats[1:], share)).as_matrix()
    np.testing.assert_allclose(came, wanted, atol=1e-9)


def test_slerp_between_equal_and_opposite_signs_stays(quats):
    half = np.full(len(quats), 0.5)
    for end in (quats, -quats):
        came = quaternions.slerp(quats, end, half)
        np.testing.assert_allclose(np.abs(np.sum(came * quats, axis=1)), 1, atol=1e-12)


def test_continuous_signs_do_not_depend_on_the_signs_that_come(quats):
    path = quaternions.slerp(quats[[0] * 50], quats[[1] * 50], np.linspace(0, 1, 50))
    flips = np.random.default_rng(1).choice([-1.0, 1.0], size=(50, 1))
    came = quaternions.continuous(path * flips)
    np.testing.assert_array_equal(came, quaternions.continuous(path))
    assert (np.sum(came[1:] * came[:-1], axis=1) > 0).all()
    assert came[0, 0] >= 0


def test_the_heading_turns_about_the_vertical_and_leaves_no_turn_about_it() -> None:
    rng = np.random.default_rng(5)
    quat = quaternions.normalised(rng.standard_normal((50, 4)))
    turn = quaternions.heading(quat)
    assert np.allclose(turn[:, 1:3], 0) and np.allclose(np.linalg.norm(turn, axis=1), 1)
    rest = quaternions.multiply(quaternions.conjugate(turn), quat)
    assert np.allclose(rest[:, 3], 0, atol=1e-12)
    assert quaternions.heading(np.array([0.0, 1.0, 0.0, 0.0])).tolist() == [1, 0, 0, 0]
