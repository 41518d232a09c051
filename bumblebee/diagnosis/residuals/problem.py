"""One set of windows with all that a fit needs: whitened residuals, sensitivities, nuisance columns, window weights."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, possible_beside, rough, without
from bumblebee.diagnosis.residuals.imu_tilt import angles, raised_by_tilt, retilted, tilt_columns, tilt_of
from bumblebee.diagnosis.residuals.initial_state import restarted, start_moves
from bumblebee.diagnosis.residuals.nuisances import nuisance_columns
from bumblebee.diagnosis.residuals.whitening import NoisyWindows, Stepped, Whitener, fit_whitener
from bumblebee.diagnosis.simulation import (
    Layout,
    Plant,
    Recall,
    Variation,
    Windows,
    damping_rates,
    residuals,
    select,
    vary,
)
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.diagnosis.thresholds.residuals import Sensitivities
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect

_GROUP = 24  # models held at once: memory, not a decision


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
    finest: float
    """Step of the last fit [s], at most `fine`."""
    between: float
    """Step [s] for sensitivities that coarse ones do not do for."""
    coarse: float
    """Step [s] for sensitivities of many candidates."""
    coarsest: float
    """The longest such step: `coarse` where nothing damps a joint within it."""
    whitener: Whitener = field(repr=False)
    nuisance: np.ndarray = field(repr=False)
    """(5 or 6, W, M) whitened: numerical differences, and last the start noise's curvature."""
    read: Windows = field(repr=False)
    """The windows with their starts as measured."""
    tilt: Effect | None = None
    """Tilt of the base's sensor with which the windows were whitened; residuals are linear in it."""
    recall: Recall = field(default_factory=Recall, repr=False)
    thresholds: Thresholds = field(default_factory=Thresholds, repr=False)
    """Thresholds of everything that is asked of the problem."""
    prior: float = 1.0
    """Weight of the nuisances' prior; see `held_to`."""

    def held_to(self, power: float) -> "Problem":
        """The problem with the nuisances' prior weighed for a model that leaves `power` (median chi-square by value).

        Against residuals a thousand times the noise a prior of one weighs nothing, and nuisances take what effects
        should. What is left is then taken for the noise's measure: the prior weighs as much more.
        """
        return replace(self, prior=max(1.0, power / self.thresholds.residuals.nuisances.held_from))

    def residual(self, effects: Sequence[Sequence[Effect]], coarse: bool = False) -> np.ndarray:
        """Whitened residuals of several models, (V, W, M)."""
        step = self.coarse if coarse else self.fine

        def simulated(new: Sequence[Sequence[Effect]]) -> np.ndarray:
            variations = [vary(self.plant, e) for e in new]
            return self.finite(residuals(self.plant, self.layout, self.windows, variations, step))

        models = [self.as_whitened(e) for e in effects]
        out = self.recall.get((self.windows, self.whitener), models, step, simulated)
        for own, e in zip(out, effects, strict=True):
            if (tilted := self.tilted(e)) is not None:
                own += tilted
        return out

    def as_whitened(self, effects: Sequence[Effect]) -> list[Effect]:
        """The effects with the tilt that the windows were whitened with, as they are simulated."""
        return retilted(effects, self.tilt) if self.tilt or tilt_of(effects) else list(effects)

    def tilted(self, effects: Sequence[Effect]) -> np.ndarray | None:
        """(W, M) what the effects' own tilt adds to the whitened residual of `as_whitened`; None for nothing."""
        away = angles(tilt_of(effects)) - angles(self.tilt)
        return np.tensordot(away, self._tilting, axes=1) if away.any() else None

    @cached_property
    def _tilting(self) -> np.ndarray:
        """(2, W, M)."""
        out = tilt_columns(self.whitener, self.layout, self.sigma, self.windows.out_time.shape[1])
        if self.windows.stance:
            turn, noise = self.thresholds.candidates.body.tilt, self.thresholds.residuals.whitening.height_noise
            raised = raised_by_tilt(self.plant, self.windows, angles(self.tilt), turn) / noise
            out += raised[..., None] * self.whitener.slopes[:, -1]
        return out

    def differences(self, effects: Sequence[Effect], moved: Sequence[Sequence[Effect]], coarse: bool) -> np.ndarray:
        """How the prediction changes from a model to several others, (V, W, M), both sides simulated in one step."""
        if coarse:
            several = self.residual([effects, *moved], coarse=True)
            return self.tamed(self.change(several[0], several[1:]))
        several = replace(self, fine=self.between).residual([effects, *moved])
        return self.change(several[0], several[1:])

    def change(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Change of the prediction (V, W, M) from residuals (W, M) to (V, W, M); none where a model is impossible."""
        least = 0.5 * self.thresholds.residuals.outliers.impossible  # what a tilted sensor adds is far less
        change = before - after
        change[(np.abs(after) > least).all(axis=(1, 2)) | (np.abs(before) > least).all()] = 0.0
        return change

    def on(self, keep: np.ndarray, effects: Sequence[Effect], coarse: bool = False) -> np.ndarray:
        """Whitened residuals (K, M) of one model on the windows at the indices `keep` (K,) alone."""
        some, step = select(self.windows, keep), self.coarse if coarse else self.fine
        raw = residuals(self.plant, self.layout, some, [vary(self.plant, self.as_whitened(effects))], step)
        out, tilted = self.finite(raw, keep)[0], self.tilted(effects)
        return out if tilted is None else out + tilted[keep]

    def finite(self, raw: np.ndarray, keep: np.ndarray | None = None) -> np.ndarray:
        """Whiten (V, W, N, D), on the windows `keep` if given.

        A window that diverged counts as a very bad one, not as none; a model of which every window did, as impossible.
        """
        bad, rule = ~np.isfinite(raw).all(axis=(-1, -2)), self.thresholds.residuals.outliers
        out = self.whitener(raw) if keep is None else self.whitener.on(keep, raw)
        if bad.any():
            good = out[~bad]
            out[bad] = rule.diverged * (np.sqrt((good**2).mean()) if good.size else 1.0)
            out[bad.all(axis=-1)] = rule.impossible
        return out

    def columns(self, candidate: Candidate, base: Sequence[Effect] = ()) -> np.ndarray:
        """Change of the prediction for one step of each free parameter, (F, W, M), simulated in coarse steps."""
        return self.sensitivities([candidate], base)

    def sensitivities(
        self, candidates: Sequence[Candidate], base: Sequence[Effect] = (), tame: bool = True
    ) -> np.ndarray:
        """The columns of several candidates, one after the other, (sum of F, W, M); tamed if that is not left to do."""
        moves = [(c, f) for c in candidates for f in range(len(c.free))]
        kinds = [e.effect for e in base]
        coarse = np.array([rough([*kinds, c.effect]) for c, _ in moves], dtype=bool)
        out = np.empty((len(moves), *self.nuisance.shape[1:]), dtype=np.float32)
        for few in (True, False):
            some = np.flatnonzero(coarse == few)
            for first in range(0, len(some), _GROUP):
                part = some[first : first + _GROUP]
                change = self._changes([moves[k] for k in part], base, few)
                out[part] = self.tamed(change) if few and tame else change
        return out

    def _changes(self, moves: Sequence[tuple[Candidate, int]], base: Sequence[Effect], coarse: bool) -> np.ndarray:
        """Changes (V, W, M) by one step of free parameters, each beside those of `base` that can stand beside it."""
        around = [possible_beside(base, c) for c, _ in moves]
        sets = [[*without(e, c), c.at(c.moved(f, 1.0))] for e, (c, f) in zip(around, moves, strict=True)]
        after, before = self.residual(sets, coarse=coarse), self.residual([base], coarse=coarse)[0]
        change = self.change(before, after)
        for k, effects in enumerate(around):
            if len(effects) < len(base):
                change[k] = self.change(self.residual([effects], coarse=coarse)[0], after[k : k + 1])[0]
        return change

    def tamed(self, change: np.ndarray) -> np.ndarray:
        """Changes (..., W, M) that were simulated in coarse steps, on a floating base no window far above the others.

        A foot that touches a coarse step earlier moves one window by more than all the others together.
        """
        rule = self.thresholds.residuals.outliers
        if not self.plant.floating or change.shape[-2] < rule.many:
            return change
        power = (change**2).sum(axis=-1)
        most = rule.largest * np.sort(power, axis=-1)[..., :-2].sum(axis=-1, keepdims=True)
        return change * np.sqrt(np.minimum(1.0, most / np.maximum(power, 1e-30)))[..., None]

    def relinearised(self, effects: Sequence[Effect]) -> "Problem":
        """Windows with nuisance columns around the model with `effects`.

        What a servo loop a millisecond late does depends on the accelerations, and these on a delay that was found:
        with the declared model's columns a delay of 13 ms came out 0.1 ms short, five standard errors.
        """
        variation, rule = vary(self.plant, effects), self.thresholds.residuals.nuisances
        raw = nuisance_columns(self.plant, self.layout, self.windows, variation, self.fine, rule)
        fresh = _columns(self.whitener, raw)
        bad = ~np.isfinite(raw).all(axis=(0, 2, 3))
        fresh[:, bad] = self.nuisance[:, bad]
        return replace(self, nuisance=fresh)

    def finely(self) -> "Problem":
        """Windows simulated in the steps of the last fit."""
        return replace(self, fine=self.finest)

    def part(self, keep: np.ndarray) -> "Problem":
        """The problem on the windows `keep`."""
        windows, read = select(self.windows, keep), select(self.read, keep)
        whitener, nuisance = self.whitener.part(keep), self.nuisance[:, keep]
        return replace(self, windows=windows, whitener=whitener, nuisance=nuisance, read=read, recall=Recall())


def make_problem(
    plant: Plant,
    layout: Layout,
    windows: Windows,
    sigma: np.ndarray,
    steps: tuple[float, float],
    effects: Sequence[Effect],
    rng: np.random.Generator,
    finest: float | None = None,
    thresholds: Thresholds | None = None,
) -> Problem:
    """Whiten `windows` around the declared model with `effects`; windows that diverge are dropped.

    `steps` [s] are for residuals and for sensitivities, `finest` for residuals of the last fit, if these are shorter.
    The windows start as measured; the problem's start where the readings after that say they did.
    """
    thresholds, (fine, coarsest) = thresholds or Thresholds(), steps
    rules = thresholds.residuals
    variation, read = vary(plant, effects), windows
    coarse = fine if _damped_within(plant, variation, windows, coarsest, rules.sensitivities) else coarsest
    # What a start's move does to a late servo shows in fine steps alone; else its delay would come out too short.
    step = coarse if plant.floating or rough(e.effect for e in effects) else fine
    noisy = NoisyWindows(plant, layout, read, variation, sigma, step, rules.whitening)
    move = start_moves(noisy, rng, rules.initial_state)
    windows = restarted(plant, layout, read, move)
    raw = nuisance_columns(plant, layout, windows, variation, fine, rules.nuisances)
    left = residuals(plant, layout, windows, [variation], fine)[0]
    stepped = Stepped(raw[0] * (fine / rules.nuisances.unit), left)
    whitener = fit_whitener(replace(noisy, windows=windows), rng, move, stepped)
    keep = whitener.valid & np.isfinite(raw).all(axis=(0, 2, 3))
    _refuse_divergent(keep, windows.span, rules.outliers.finite)
    windows, raw, whitener = select(windows, keep), raw[:, keep], whitener.part(keep)
    columns = _columns(whitener, raw)
    finest, read = fine if finest is None else finest, select(read, keep)
    return Problem(
        plant, layout, windows, sigma, fine, finest, fine, coarse, coarsest, whitener, columns, read,
        tilt_of(effects), thresholds=thresholds,
    )  # fmt: skip


def _damped_within(plant: Plant, variation: Variation, windows: Windows, step: float, rule: Sensitivities) -> bool:
    """Whether damping brings a joint to rest within `step` [s]: then it shows neither inertia nor damping."""
    some = np.unique(np.linspace(0, len(windows) - 1, rule.poses).round().astype(int))
    rates = damping_rates(plant, variation, select(windows, some), joints=True)
    return bool(np.median(rates) * step > rule.damped)


def _refuse_divergent(keep: np.ndarray, span: float, least: float) -> None:
    """`BadInput` where less than a share `least` of the windows (W,) of `span` s stay finite."""
    if keep.mean() < least:
        raise BadInput(
            f"declared model, {(~keep).sum()} of {len(keep)} windows",
            f"simulations that stay finite for {span:.2g} s from the measured states and commands",
            "simulations that diverge",
            "Look at gains, time step and units of the declared model.",
        )


def _columns(whitener: Whitener, raw: np.ndarray) -> np.ndarray:
    """Nuisances (B + 1, W, M) of B numerical differences (B, W, N, D) and the start noise's curvature."""
    return np.concatenate((whitener(raw, centre=False), whitener.curvature[None]))


def window_weights(residual: np.ndarray) -> np.ndarray:
    """Weights (W,) that stop a few impacts or falls from deciding everything: 1 at the median power, 2 at none."""
    power = (residual**2).mean(axis=-1)
    return 2.0 / (1.0 + power / max(float(np.median(power)), 1e-12))


def screening_windows(problem: Problem, budget: int) -> np.ndarray:
    """Indices of at most `budget` windows, spread evenly."""
    count = len(problem.windows)
    return np.unique(np.linspace(0, count - 1, min(budget, count)).round().astype(int))
