"""Metrics of an episode, by hand."""

import numpy as np
import pytest

from bumblebee.evaluation.metrics import episode_metrics


def arrays(frames: int, shift: float = 0.0, angle: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    key = np.zeros((frames, 14, 3))
    key[:, :, 0] = shift
    return np.full((frames, 23), angle), key


def test_errors_are_means_of_angles_and_of_distances() -> None:
    """Half the joints 0.1 rad off, all bodies 3-4-0 cm off: 0.05 rad and 50 mm."""
    reference_q, reference_key = arrays(10)
    q, key = arrays(10)
    q[:, :12], q[:, 12:] = 0.1, -0.2
    key[..., 0], key[..., 1] = 0.03, 0.04
    result = episode_metrics(q, key, reference_q, reference_key, 0.4)
    assert result.success and result.end_reason == "end" and result.frames == 10
    assert result.mpjpe_rad == pytest.approx((12 * 0.1 + 11 * 0.2) / 23)
    assert result.mpkpe_mm == pytest.approx(50.0)


def test_one_body_beyond_the_threshold_in_one_frame_ends_the_episode_there() -> None:
    reference_q, reference_key = arrays(10)
    q, key = arrays(10, shift=0.01)
    key[6, 3, 2] = 0.41
    q[6:] = 9.0
    result = episode_metrics(q, key, reference_q, reference_key, 0.4)
    assert not result.success and result.end_reason == "keypoint" and result.frames == 6
    assert result.mpkpe_mm == pytest.approx(10.0) and result.mpjpe_rad == 0.0
    assert episode_metrics(q, key, reference_q, reference_key, 0.8).success


def test_an_episode_that_stopped_early_is_a_fall_and_never_a_success() -> None:
    reference_q, reference_key = arrays(10)
    q, key = arrays(9)
    result = episode_metrics(q, key, reference_q, reference_key, 0.4)
    assert (result.success, result.end_reason, result.frames) == (False, "fall", 9)


def test_a_threshold_missed_in_the_first_frame_still_gives_numbers() -> None:
    reference_q, reference_key = arrays(5)
    q, key = arrays(5, shift=2.0)
    result = episode_metrics(q, key, reference_q, reference_key, 0.4)
    assert result.frames == 1 and result.mpkpe_mm == pytest.approx(2000.0)


def test_not_a_number_is_not_a_success() -> None:
    reference_q, reference_key = arrays(5)
    q, key = arrays(5)
    key[3] = np.nan
    result = episode_metrics(q, key, reference_q, reference_key, 0.4)
    assert not result.success and result.frames == 3
