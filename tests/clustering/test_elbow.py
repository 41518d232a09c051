"""Kneedle on curves whose knee is known, and on those that have none."""

import numpy as np
import pandas as pd
import pytest

from bumblebee.clustering.elbow import knee


def curve(within: list[float]) -> pd.DataFrame:
    return pd.DataFrame({"k": range(1, len(within) + 1), "within_ss": within})


def test_the_example_of_the_paper_on_kneedle() -> None:
    """Its figure 2, y = 5 - 1 / (x + 0.1) on ten points, has its knee at x = 0.22; turned upside down it falls."""
    x = np.linspace(0, 1, 10)
    assert knee(curve(list(1 / (x + 0.1)))) == 1 + int(np.argmin(abs(x - 0.2222)))


def test_a_curve_in_use_elsewhere() -> None:
    assert knee(curve([2314, 802, 519, 417, 358, 318, 302, 284, 280])) == 3


@pytest.mark.parametrize("within", [[10, 8, 6, 4, 2, 0], [10, 10, 9.5, 8, 5, 0], [4.0, 1.0], [3.0, 3.0, 3.0]])
def test_a_straight_or_bulging_curve_has_no_elbow(within: list[float]) -> None:
    assert knee(curve([float(w) for w in within])) is None


def test_of_two_bends_the_sharper_one_is_named() -> None:
    assert knee(curve([100, 30, 29, 28, 10, 9.5, 9, 8.5])) == 2
    assert knee(curve([100, 80, 79, 78, 10, 9.5, 9, 8.5])) == 5
