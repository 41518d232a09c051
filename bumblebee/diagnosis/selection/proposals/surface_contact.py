"""Contact with a surface that the model lacks: a table under an arm, a floor under a hand.

A joint that stands while its drive pulls looks like dry friction, and a robot is fitted with the friction of a table.
What tells them apart is where it happens: in some poses alone, those in which one point of one body is lowest. So
several hundred windows of the fitted rollouts, far more than a fit takes, are asked how low each of several hundred
points of each body comes in them; the points that part them best by how far they are off, and surfaces between the
lowest place of each and where windows begin to be off, are tried in the simulator, and the best is moved until nothing
is gained by it. The joint fit then moves the surface and its friction; the point stays where it is, for a higher point
and a higher surface are the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_chosen
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.estimation import Fit, LeftOver, typical_power
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.joint_misfit import falls
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.simulation import Windows, choose_starts, cut, residuals, select, vary
from bumblebee.diagnosis.thresholds.proposals import SurfaceContact
from bumblebee.sim.effects import Effect

KIND = "surface_contact"


@dataclass(frozen=True, eq=False)
class _Many:
    """Many windows of the fitted rollouts, and how far off a fit leaves each; joint positions alone, not whitened."""

    problem: Problem
    fit: Fit
    windows: Windows
    size: np.ndarray
    """(J,) root mean square of what is left of each joint's position."""
    power: np.ndarray
    """(W,) mean square of what is left, in units of `size`."""
    most: float
    """Largest cost of a window, that of one that diverges included."""

    def falls(self, keep: np.ndarray, models: Sequence[Sequence[Effect]]) -> np.ndarray:
        """Falls (V, K) of log(1 + power / its median) of some windows by each of some more effects."""
        usual = max(float(np.median(self.power)), 1e-12)
        return np.log1p(self.power[keep] / usual) - np.log1p(self._powers(keep, models) / usual)

    def _powers(self, keep: np.ndarray, models: Sequence[Sequence[Effect]]) -> np.ndarray:
        """Costs (V, K) of some windows under the fit's effects and each of some more."""
        effects = [[*self.fit.effects, *more] for more in models]
        return np.minimum(_left(self.problem, select(self.windows, keep), effects, self.size), self.most)


def _left(
    problem: Problem, windows: Windows, models: Sequence[Sequence[Effect]], size: np.ndarray | float
) -> np.ndarray:
    """Mean squares (V, W) of what models leave of joint positions, in units of `size`; infinite where one diverges."""
    plant, part = problem.plant, problem.layout.slices["joint_pos"]
    raw = residuals(plant, problem.layout, windows, [vary(plant, effects) for effects in models], problem.coarse)
    return np.nan_to_num(((raw[..., part] / size) ** 2).mean(axis=(2, 3)), nan=np.inf)


def _windows(problem: Problem, rule: SurfaceContact) -> Windows:
    """Windows as long as those of a fit, spread evenly over its rollouts."""
    source, ids = problem.windows.source, np.unique(problem.windows.rollout).tolist()
    starts = choose_starts(source, ids, problem.windows.span, rule.many, problem.plant.thresholds.windows)
    return cut(problem.plant, problem.layout, source, starts, outputs=rule.outputs)


def _many(problem: Problem, fit: Fit, rule: SurfaceContact, later: Windows | None = None) -> _Many:
    """Many windows, those of 1 s if given, and what a fit leaves of them."""
    windows, most = _windows(problem, rule) if later is None else later, 1.0 / rule.least_power
    plant, part = problem.plant, problem.layout.slices["joint_pos"]
    raw = residuals(plant, problem.layout, windows, [vary(plant, fit.effects)], problem.coarse)[0][..., part]
    size = np.maximum(np.sqrt(np.nanmean(raw**2, axis=(0, 1))), problem.sigma[part])
    power = np.nan_to_num(((raw / size) ** 2).mean(axis=(1, 2)), nan=np.inf)
    return _Many(problem, fit, windows, size, np.minimum(power, most), most)


@dataclass(frozen=True, eq=False)
class _Place:
    """A point of a body that is low in the windows that are off."""

    candidate: Candidate
    point: np.ndarray
    """(3,) in the body's frame [m]."""
    lows: np.ndarray
    """(W,) lowest heights in the windows [m]."""
    below: float
    """Height below which windows are off [m]."""
    z: float
    """Standard errors by which the logarithm of their power is above that of the others."""
    reach: float
    """How far along each axis from the body's frame a point may be [m]."""


def surface_trials(
    problem: Problem,
    fit: Fit,
    candidates: Sequence[Candidate],
    weights: np.ndarray,
    closed: Sequence[Candidate] = (),
    judge: Problem | None = None,
) -> list[Trial]:
    """The contact with a surface that explains most; none where none does, or on a body where one was `closed`.

    It must make nearly all windows better that it changes, of the fitted rollouts and of those of `judge`; where no
    rollout of these reaches it, more of the fitted ones.
    """
    rule = problem.thresholds.selection.proposals.surface_contact
    refused = {c.where for c in closed if c.effect == KIND}
    own = [c for c in candidates if c.effect == KIND and c.where not in refused and not is_chosen(c, fit.chosen)]
    if not own or problem.plant.model.nv > rule.small_robot:
        return []
    clean = fit.clean(problem)
    if np.quantile((clean**2).mean(axis=1), 1.0 - rule.share) < rule.off * max(typical_power(clean), 1.0):
        return []
    many = _many(problem, fit, rule)
    tried = [_Tried(many, place, rule) for place in _spread(_places(many, own, rule), rule.tried)]
    best = sorted(tried, key=lambda one: -one.gain)[: rule.moved]
    climbed = sorted((one.climbed() for one in best), key=lambda one: -one.gain)
    others = None if judge is None else _many(judge, fit, rule)
    for one in climbed:
        if (trial := one.trial(weights)) is not None and _is_confirmed(one.effect, many, others, rule):
            return [trial]
    return []


def is_still_confirmed(problem: Problem, fit: Fit, candidate: Candidate, holdout: Holdout) -> bool:
    """Whether a chosen contact still makes better what it changes, with the other effects of the fit where they are.

    After 1 s, too: what holds the arm for a moment where it should slide is right after 0.2 s and wrong after 1 s.
    """
    rule, rest = problem.thresholds.selection.proposals.surface_contact, fit.without([candidate])
    others = None if holdout.problem is None else _many(holdout.problem, rest, rule)
    effect = candidate.at(fit.of(candidate))
    if not _is_confirmed(effect, _many(problem, rest, rule), others, rule):
        return False
    felt = np.empty(0) if holdout.long is None else _felt(effect, _many(problem, rest, rule, holdout.long), rule)
    return len(felt) < rule.least_felt or bool((felt > 0).mean() >= rule.nearly_later)


def contact_share(problem: Problem, fit: Fit, candidate: Candidate, judge: Problem | None) -> float:
    """Share of what all effects take off the mean square of joint positions that comes back without a chosen contact.

    Of as many windows as its proposal asks, of the fitted rollouts and those of `judge`: of the few of a fit or a
    validation perhaps none touches. Each position counts in units of its noise.
    """
    rule, rest = problem.thresholds.selection.proposals.surface_contact, fit.without([candidate])
    powers = np.zeros(3)
    for one in (problem, *([judge] if judge is not None else [])):
        sigma = one.sigma[one.layout.slices["joint_pos"]]
        left = _left(one, _windows(one, rule), [fit.effects, rest.effects, []], sigma)
        powers += left[:, np.isfinite(left).all(axis=0)].sum(axis=1)
    return float(np.clip((powers[1] - powers[0]) / max(powers[2] - powers[0], 1e-12), 0.0, 1.0))


def _is_confirmed(effect: Effect, fitted: _Many, others: _Many | None, rule: SurfaceContact) -> bool:
    """Whether nearly all windows that it changes are better, of all windows of the fitted rollouts and others."""
    own, seen = _felt(effect, fitted, rule), np.empty(0) if others is None else _felt(effect, others, rule)
    enough = rule.least_felt if len(seen) else rule.least_felt_alone
    return len(own) >= enough and all((some > 0).mean() >= rule.nearly for some in (own, seen) if len(some))


def _felt(effect: Effect, many: _Many, rule: SurfaceContact) -> np.ndarray:
    """Falls of the windows' log(1 + power / its median) where an effect changes that."""
    (gain,) = many.falls(np.arange(len(many.windows)), [[effect]])
    return gain[np.abs(gain) > rule.felt]


def _places(many: _Many, own: Sequence[Candidate], rule: SurfaceContact) -> list[_Place]:
    """Points of the candidates' bodies that part the windows by how far they are off, the best first."""
    model, names = many.problem.plant.model, [c.where for c in own]
    reach = rule.reach * _longest(model, names)
    along = reach * np.linspace(-1.0, 1.0, rule.points)
    points = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1).reshape(-1, 3)
    origin, upward = _poses(many, names)
    off = np.log(np.maximum(many.power, rule.least_power))
    found = []
    for k, c in enumerate(own):
        lows = (origin[:, :, k, None] + upward[:, :, k] @ points.T).min(axis=1)
        found += [
            _Place(c, points[p], lows[:, p], below, z, reach)
            for p, (z, below) in enumerate(_parted(lows, off, rule))
            if z > rule.z and below - lows[:, p].min() < rule.deep
        ]
    return sorted(found, key=lambda place: -place.z)


def _longest(model: mujoco.MjModel, bodies: Sequence[str]) -> float:
    """Length [m] of the longest link between two bodies, or twice as far as a centre of mass of the `bodies` lies."""
    links = np.linalg.norm(model.body_pos[model.body_parentid > 0], axis=1)
    halves = [np.linalg.norm(model.body_ipos[model.body(name).id]) for name in bodies]
    return float(max([*links, *(2.0 * half for half in halves)]))


def _spread(places: Sequence[_Place], count: int) -> list[_Place]:
    """The first places of each body in turn, at most `count`."""
    turns: dict[str, int] = {}
    ranked = []
    for place in places:
        where = place.candidate.where
        ranked.append((turns.get(where, 0), -place.z, place))
        turns[where] = turns.get(where, 0) + 1
    return [place for _, _, place in sorted(ranked, key=lambda row: row[:2])[:count]]


def _poses(many: _Many, bodies: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Heights (W, N, B) [m] of the bodies' frames at the windows' ticks, and rows (W, N, B, 3) that turn points up."""
    plant, windows = many.problem.plant, many.windows
    ids, data = [int(plant.model.body(name).id) for name in bodies], mujoco.MjData(plant.model)
    read = windows.measured[..., many.problem.layout.slices["joint_pos"]]
    origin, upward = np.empty((*read.shape[:2], len(ids))), np.empty((*read.shape[:2], len(ids), 3))
    for w, n in np.ndindex(read.shape[:2]):
        data.qpos[:] = windows.qpos[w]
        data.qpos[plant.qpos] = read[w, n]
        mujoco.mj_kinematics(plant.model, data)
        origin[w, n], upward[w, n] = data.xpos[ids, 2], data.xmat[ids, 6:9]
    return origin, upward


def _parted(lows: np.ndarray, off: np.ndarray, rule: SurfaceContact) -> list[tuple[float, float]]:
    """For each point, by its lowest heights (W, P): how plainly a height parts the windows, and that height."""
    count = len(off)
    order = np.argsort(lows, axis=0)
    below = np.arange(rule.least_windows, max(int(rule.most_share * count), rule.least_windows) + 1)
    below = below[below < count]
    if not len(below):
        return []
    sums = np.cumsum(off[order], axis=0)
    first, rest = sums[below - 1] / below[:, None], (sums[-1] - sums[below - 1]) / (count - below)[:, None]
    z = (first - rest) / (max(off.std(), 1e-12) * np.sqrt(1.0 / below + 1.0 / (count - below)))[:, None]
    best = z.argmax(axis=0)
    heights = np.take_along_axis(lows, order, axis=0)
    edge = 0.5 * (heights[below - 1] + heights[below])
    return [(float(z[k, p]), float(edge[k, p])) for p, k in enumerate(best)]


class _Tried:
    """A surface about a place, sought on the windows that come lowest there and on some of the others."""

    def __init__(self, many: _Many, place: _Place, rule: SurfaceContact) -> None:
        self.many, self.place, self.rule = many, place, rule
        order, count = np.argsort(place.lows), rule.windows
        others: np.ndarray | list[int]
        others = np.linspace(count, len(order) - 1, count).astype(int) if len(order) > 2 * count else []
        self.keep = np.sort(order[[*range(min(count, len(order))), *others]])
        low = float(place.lows.min())
        begun = [np.array([low + share * (place.below - low), *place.point]) for share in rule.heights]
        tried = self._gains(begun)
        self.surface, self.gain = begun[int(np.argmax(tried))], max(tried)

    def _values(self, surface: np.ndarray) -> np.ndarray:
        """Parameters (5,) of the effect with a surface (4,): its height and the point [m]."""
        return np.array([*surface, self.place.candidate.start[4]])

    def _gains(self, surfaces: Sequence[np.ndarray]) -> list[float]:
        """Falls of log(1 + power / its median), summed over the windows."""
        models = [[self.place.candidate.at(self._values(s))] for s in surfaces]
        return self.many.falls(self.keep, models).sum(axis=1).tolist()

    def climbed(self) -> "_Tried":
        """Itself after moves along single axes, halved where none gains."""
        size = self.rule.coarse
        for _ in range(self.rule.moves):
            around = [self.surface + size * sign * axis for axis in np.eye(4) for sign in (1.0, -1.0)]
            around = [s for s in around if np.abs(s[1:]).max() <= self.place.reach]
            tried = self._gains(around)
            if max(tried) > self.gain + self.rule.worth * abs(self.gain):
                self.surface, self.gain = around[int(np.argmax(tried))], max(tried)
            elif size <= self.rule.fine:
                break
            else:
                size = max(0.5 * size, self.rule.fine)
        return self

    @property
    def effect(self) -> Effect:
        """As it is now."""
        return self.place.candidate.at(self._values(self.surface))

    def trial(self, weights: np.ndarray) -> Trial | None:
        """The trial on the fit's windows; None where it gains too little there."""
        problem, fit, rule, c = self.many.problem, self.many.fit, self.rule, self.place.candidate
        away = float(np.ptp(self.place.lows)) + rule.coarse
        nominal = (float(self.surface[0]) - away, *map(float, self.surface[1:]), c.nominal[4])
        own, values = replace(c, nominal=nominal, step=(rule.step, *c.step[1:])), self._values(self.surface)
        after = problem.residual([[*fit.effects, own.at(values)]])[0]
        each = falls(problem, fit.residual, after, max(typical_power(fit.clean(problem)), 1.0))
        if each.sum() < rule.least_gain:
            return None
        left_over = LeftOver(problem, fit, weights)
        return Trial(own, values, left_over.cost(after), left_over.left(fit.residual - after))
