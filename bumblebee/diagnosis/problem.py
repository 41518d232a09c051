"""One set of windows with all that a fit needs: whitened residuals, sensitivities, nuisance columns, window weights."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.nuisance import nuisance_columns
from bumblebee.diagnosis.plant import Plant
from bumblebee.diagnosis.signals import Layout
from bumblebee.diagnosis.simulate import residuals
from bumblebee.diagnosis.variation import vary
from bumblebee.diagnosis.whiten import Whitener, fit_whitener
from bumblebee.diagnosis.windows import Windows, select
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect

_OUTLIER = 8.0  # a window this many times worse than the median is weighted down


@dataclass(frozen=True, eq=False)
class Problem:
    """W windows, M whitened values each."""

    plant: Plant
    layout: Layout
    windows: Windows
    sigma: np.ndarray
    """(D,) noise."""
    fine: float
    """Step [s] for residuals."""
    coarse: float
    """Step [s] for sensitivities of many candidates."""
    whitener: Whitener = field(repr=False)
    nuisance: np.ndarray = field(repr=False)
    """(3, W, M) whitened."""

    def residual(self, effects: Sequence[Sequence[Effect]]) -> np.ndarray:
        """Whitened residuals of several models, (V, W, M)."""
        variations = [vary(self.plant, e) for e in effects]
        raw = residuals(self.plant, self.layout, self.windows, variations, self.fine)
        return self._finite(raw)

    def _finite(self, raw: np.ndarray) -> np.ndarray:
        """Whiten; a window that diverged counts as a very bad one, not as none."""
        bad = ~np.isfinite(raw).all(axis=(-1, -2))
        out = self.whitener(raw)
        if bad.any():
            good = out[~bad]
            out[bad] = 10.0 * (np.sqrt((good**2).mean()) if good.size else 1.0)
        return out

    def sensitivities(self, candidates: Sequence[Candidate], base: Sequence[Effect] = ()) -> np.ndarray:
        """Change of the prediction per `step` of each candidate, by one-sided differences, (C, W, M)."""
        model = vary(self.plant, base)
        reference = residuals(self.plant, self.layout, self.windows, [model], self.coarse)[0]
        out = np.empty((len(candidates), *self.nuisance.shape[1:]), dtype=np.float32)
        group = 24  # models held at once
        for first in range(0, len(candidates), group):
            part = candidates[first : first + group]
            others = [vary(self.plant, [*_without(base, c), c.at(c.nominal + c.step)]) for c in part]
            raw = residuals(self.plant, self.layout, self.windows, others, self.coarse)
            out[first : first + group] = self.whitener(reference - raw, centre=False)
        return out


def _without(effects: Sequence[Effect], candidate: Candidate) -> list[Effect]:
    return [e for e in effects if (e.effect, e.where) != (candidate.effect, (candidate.where,))]


def make_problem(
    plant: Plant,
    layout: Layout,
    windows: Windows,
    sigma: np.ndarray,
    steps: tuple[float, float],
    effects: Sequence[Effect],
    rng: np.random.Generator,
) -> Problem:
    """Whiten `windows` around the declared model with `effects`; windows that diverge are dropped."""
    fine, coarse = steps
    variation = vary(plant, effects)
    whitener = fit_whitener(plant, layout, windows, variation, sigma, coarse, rng)
    raw = nuisance_columns(plant, layout, windows, variation, fine)
    keep = whitener.valid & np.isfinite(raw).all(axis=(0, 2, 3))
    if keep.mean() < 0.5:
        raise BadInput(
            f"declared model, {(~keep).sum()} of {len(keep)} windows",
            f"simulations that stay finite for {windows.span:.2g} s from the measured states and commands",
            "simulations that diverge",
            "Look at gains, time step and units of the declared model.",
        )
    windows, raw = select(windows, keep), raw[:, keep]
    whitener = Whitener(whitener.factor[keep], whitener.bias[keep], whitener.valid[keep])
    return Problem(plant, layout, windows, sigma, fine, coarse, whitener, whitener(raw, centre=False))


def window_weights(residual: np.ndarray) -> np.ndarray:
    """Weights (W,) in (0, 1] that stop a few impacts from deciding everything."""
    power = (residual**2).mean(axis=-1)
    return np.minimum(1.0, _OUTLIER * np.median(power) / np.maximum(power, 1e-12))
