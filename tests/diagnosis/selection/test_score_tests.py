"""Score tests: how sure an effect is does not depend on where it acts most, unless one window is all that shows it."""

from types import SimpleNamespace

import numpy as np

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.selection.score_tests import score_tests
from bumblebee.diagnosis.sensitivities.columns import Columns
from bumblebee.diagnosis.thresholds import Thresholds

_WINDOWS, _VALUES = 40, 60


def _z(sizes: np.ndarray, there: float, seed: int, factor: float = 1.0) -> float:
    """The z of a candidate whose column has `sizes` (W,) times unit power, in noise of `factor`, there by a share."""
    rng = np.random.default_rng(seed)
    column = rng.standard_normal((1, _WINDOWS, _VALUES)) * sizes[None, :, None] / np.sqrt(_VALUES)
    residual = there * column[0] + factor * rng.standard_normal((_WINDOWS, _VALUES))
    nuisance = rng.standard_normal((2, _WINDOWS, _VALUES))
    problem = SimpleNamespace(nuisance=nuisance, thresholds=Thresholds(), prior=1.0)
    fit = SimpleNamespace(residual=residual, columns=np.empty((0, _WINDOWS, _VALUES)))
    candidate = Candidate("coulomb_friction", "j", (0.0,), (1.0,))
    columns = Columns([candidate], column.astype(np.float32))
    return float(score_tests(problem, columns, fit, np.ones(_WINDOWS)).z[0])


def test_an_effect_that_acts_in_some_windows_more_is_as_sure_as_one_that_acts_in_all() -> None:
    """Same chi-square, spread evenly or with nine tenths of it in a quarter of the windows."""
    even, uneven = np.ones(_WINDOWS), np.where(np.arange(_WINDOWS) % 4, np.sqrt(1 / 7.5), np.sqrt(3.6))
    assert np.isclose((even**2).sum(), (uneven**2).sum())
    found = [np.median([_z(sizes, 3.0, seed) for seed in range(20)]) for sizes in (even, uneven)]
    assert found[1] > 0.8 * found[0]
    assert found[1] > 0.7 * 3.0 * np.sqrt(_WINDOWS)


def test_one_window_alone_makes_nothing_sure() -> None:
    """However far off the only window is in which a candidate acts."""
    sizes = np.zeros(_WINDOWS)
    sizes[7] = 1.0
    assert all(_z(sizes, 100.0, seed) < 2.0 for seed in range(10))


def test_noise_gives_z_of_a_standard_normal() -> None:
    """Whatever the noise's own size, with windows of unequal say."""
    sizes = np.where(np.arange(_WINDOWS) % 4, 0.4, 1.8)
    z = np.array([_z(sizes, 0.0, seed, factor=1.5) for seed in range(300)])
    assert 0.8 < np.sqrt((z**2).mean()) < 1.15
