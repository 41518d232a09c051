"""Sizes that no slope leads to: a series, ended early where it is told, and a closer look around its best."""

import numpy as np
import pytest

from bumblebee.diagnosis.selection.profile import halved, profile, reachable, stepped


def hill(size: float) -> float:
    """Largest at 3."""
    return -((size - 3.0) ** 2)


def test_the_best_of_a_series_lies_between_its_neighbours() -> None:
    found = profile(lambda sizes: [hill(s) for s in sizes], [0.0, 2.0, 4.5, 9.0])
    assert (found.size, found.gain, found.around) == (2.0, -1.0, (0.0, 2.0, 4.5))


def test_sizes_after_the_end_are_not_tried() -> None:
    asked: list[float] = []

    def gains(sizes: list[float]) -> list[float]:
        asked.extend(sizes)
        return [hill(s) for s in sizes]

    found = profile(gains, [3.0, 5.0, 7.0, 9.0], lambda so_far: so_far[-1] < -3.0)
    assert asked == list(found.sizes) == [3.0, 5.0]
    assert found.size == 3.0


def test_halving_comes_nearer_and_never_loses_what_was_best() -> None:
    size, most = halved(hill, (0.0, 2.0, 8.0), hill(2.0), 8)
    assert size == pytest.approx(3.0, abs=0.2)
    assert most == hill(size)
    assert halved(hill, (2.0, 3.0, 4.0), 0.0, 5) == (3.0, 0.0)


def test_steps_go_to_the_side_that_gains_and_stay_where_none_does() -> None:
    size, most = stepped(hill, 2.0, hill(2.0), (1.4, 1.1))
    assert size == pytest.approx(2.0 * 1.4 * 1.1)
    assert most == hill(size)
    assert stepped(hill, 3.0, 0.0, (1.4, 1.1)) == (3.0, 0.0)


def test_steps_ask_for_nothing_but_what_is_reachable() -> None:
    """To the last bit: what is worked out for a size beforehand is found by that size."""
    ratios = (1.25, 1.12, 1.06, 1.03)
    for best in np.geomspace(0.5, 2.0, 41):
        asked: list[float] = []

        def gain(size: float, best: float = best, asked: list[float] = asked) -> float:
            asked.append(size)
            return -abs(np.log(size / best))

        stepped(gain, 1.0, -abs(np.log(1.0 / best)), ratios)
        assert set(asked) <= set(reachable(ratios))
