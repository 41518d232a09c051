"""The basis functions of a missing torque: terms of `effects.terms` that belong together, simplest first.

Some of them are effects of the catalogue in other words (dry and viscous friction, springs, one harmonic of cogging,
gains ...). They compete with the others, so that what the search did not accept is not taken for something new, but no
discovered effect is made of them alone.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.discrepancy.regressors import Quantities
from bumblebee.diagnosis.thresholds.discrepancy import TermLibrary
from bumblebee.effects.law import QUANTITIES, Law, waves
from bumblebee.sim.effects import CATALOGUE, Term, read_term

_MOST_TARGET_STEPS = 250.0
"""Steps over its range at most of a target that arrives in steps."""
_FASTEST_STRENGTH_BEAT = 3.0
"""Fastest beat of the drive's strength [Hz]."""
_FASTEST_FRICTION_BEAT = 1.0
"""Fastest beat of dry friction [Hz]."""
_FEWEST_KNOTS = 3
"""Different knots that a table needs; with less it gets the smallest, the mean and the largest value."""

_POSITION, _VELOCITY, _TARGET, _TORQUE, _TIME, _HISTORY = ((name,) for name in QUANTITIES)


@dataclass(frozen=True, eq=False)
class BasisFunction:
    """Terms whose coefficients are found together."""

    texts: tuple[str, ...]
    on: tuple[str, ...]
    """Quantities that it depends on: of `QUANTITIES`, or "another joint (NAME)"."""
    cost: int
    """Complexity: of basis functions that explain nearly the same the cheapest is named."""
    effect: str = ""
    """The catalogue's effect that it is, if any."""
    at: float = 0.0
    """Its inner number (a frequency, an edge), where it has one; else 0."""
    family: Callable[[float], tuple[str, ...]] | None = None
    """Texts for another inner number."""
    reach: float = 0.0
    """How far the inner number may move before the next basis function of its kind is nearer."""

    @property
    def terms(self) -> list[Term]:
        """Its terms, ready to be evaluated."""
        return [read_term(text) for text in self.texts]

    @property
    def table(self) -> bool:
        """Whether it is a table of heights instead of a formula."""
        return "curve(" in self.texts[0]

    def torque(self, data: Quantities, joint: int) -> np.ndarray:
        """(F, W, S) mean torques for coefficient 1."""
        return np.stack([data.torque(term, joint) for term in self.terms])

    def moved(self, at: float) -> "BasisFunction":
        """The basis function with another inner number."""
        assert self.family is not None
        return BasisFunction(self.family(at), self.on, self.cost, self.effect, at, self.family, self.reach)


def other_joint(name: str) -> str:
    """How a dependence on another joint is called."""
    return f"another joint ({name})"


def basis_functions(data: Quantities, joint: int) -> list[BasisFunction]:
    """Basis functions for a joint (an index), whose numbers follow from the data."""
    found = [*_catalogue(data, joint), *_friction(data, joint), *_position(data, joint), *_velocity()]
    found += [*_target(data, joint), *_torque(data, joint), *_time(data, joint), *_others(data, joint)]
    return found + list(_tables(data, joint))


def _catalogue(data: Quantities, j: int) -> Iterator[BasisFunction]:
    """Basis functions that effects of the catalogue look like on one joint."""
    driven = bool(np.ptp(data.tau[..., j]) > 0)
    for kind, law in ((name, kind.law) for name, kind in CATALOGUE.items()):
        if isinstance(law, Law) and (driven or not law.driven):
            for texts, on, cost, *inner in law.rows(data, j):
                yield BasisFunction(texts, on, cost, kind, *inner)


def _friction(data: Quantities, j: int) -> Iterator[BasisFunction]:
    rule, travel = data.thresholds.term_library, float(np.ptp(data.q[..., j]))
    yield BasisFunction(("friction(q)",), _POSITION, 3)
    yield BasisFunction(("friction(q)", "friction(q^2)"), _POSITION, 4)
    for n in range(1, rule.friction_harmonics + 1):
        if n * travel > rule.friction_travel:
            yield BasisFunction(
                waves("friction({})")(n), _POSITION, 3, "", float(n), waves("friction({})"), rule.friction_reach
            )
    yield BasisFunction(("friction(t)",), _TIME, 3)
    for time in rule.rest_times:
        for way in rule.rest_ways:
            yield _rest(time, way)


def _rest(time: float, way: float) -> BasisFunction:
    return BasisFunction((f"friction(rested({time:.3g}, {way:.3g}))",), _HISTORY, 3)


def neighbours(function: BasisFunction, rule: TermLibrary) -> list[BasisFunction]:
    """Basis functions with other inner numbers next to those of a basis function that has two; [] for others.

    Friction that holds a joint is far from linear: which of them is best, only the simulator tells.
    """
    found = re.fullmatch(r"friction\(rested\(([^,]+), ([^)]+)\)\)", function.texts[0])
    if found is None:
        return []
    time, way = float(found[1]), float(found[2])
    longer, further = rule.rest_time_ratio, rule.rest_way_ratio
    ratios = ((longer, 1.0), (1 / longer, 1.0), (1.0, further), (1.0, 1 / further))
    return [_rest(time * f, way * g) for f, g in ratios]


def _position(data: Quantities, j: int) -> Iterator[BasisFunction]:
    yield BasisFunction(("q^2",), _POSITION, 2)
    yield BasisFunction(("q^3",), _POSITION, 2)
    yield BasisFunction(("q^2", "q^3"), _POSITION, 4)
    rule = data.thresholds.term_library
    edges = np.quantile(data.q[..., j], np.linspace(*rule.edge_quantiles, rule.edges))
    for edge in edges:
        for make in (_above, _below):
            yield BasisFunction(
                make(edge), _POSITION, 2, "", float(edge), make, float(np.ptp(edges) / (rule.edges - 1))
            )


def _velocity() -> Iterator[BasisFunction]:
    yield BasisFunction(("v^3",), _VELOCITY, 3)
    yield BasisFunction(("q*v",), (*_VELOCITY, *_POSITION), 3)
    yield BasisFunction(("q^2*v",), (*_VELOCITY, *_POSITION), 4)


def _target(data: Quantities, j: int) -> Iterator[BasisFunction]:
    """Dead bands, and targets that arrive in steps."""
    rule, u, tau = data.thresholds.term_library, data.u[..., j], data.tau[..., j]
    if np.ptp(u) == 0 or np.array_equal(u, tau):
        return
    error = np.abs(u - data.q[..., j])
    for band in np.quantile(error, rule.dead_band_quantile) * np.geomspace(*rule.dead_bands):
        yield BasisFunction(_bound(band), _TARGET, 2, "", float(band), _bound, rule.dead_band_reach * float(band))
    yield BasisFunction(("(u - q)^3",), _TARGET, 3)
    moves = np.abs(np.diff(u, axis=1)) / data.tick
    for rate in np.geomspace(*rule.slew_rates) * float(moves.max()):
        make = _slewed(data.tick)
        yield BasisFunction(make(rate), (*_TARGET, *_HISTORY), 2, "", float(rate), make, rule.slew_reach * float(rate))
    span = float(np.ptp(u))
    for steps in np.arange(rule.least_target_steps, _MOST_TARGET_STEPS, rule.target_steps_apart):
        size = span / steps
        if size > rule.least_target_step:
            yield BasisFunction(_stair(size), _TARGET, 3, "", size, _stair, rule.target_steps_apart * size / steps)


def _torque(data: Quantities, j: int) -> Iterator[BasisFunction]:
    if np.ptp(data.tau[..., j]) > 0:
        yield BasisFunction(("tau*abs(tau)",), _TORQUE, 3)
        yield BasisFunction(("abs(tau)",), _TORQUE, 3)
        yield BasisFunction(("tau*abs(v)",), (*_TORQUE, *_VELOCITY), 4)


def _time(data: Quantities, j: int) -> Iterator[BasisFunction]:
    """Beats in time, by themselves or of the drive's strength."""
    rule, span = data.thresholds.term_library, float(np.ptp(data.t))
    step = rule.beat_step / max(span, 1e-6)
    yield BasisFunction(("t", "1"), _TIME, 2)
    beats = (
        ("{}", rule.fastest_beat),
        ("tau*{}", _FASTEST_STRENGTH_BEAT),
        ("friction({})", _FASTEST_FRICTION_BEAT),
    )
    for kind, fastest in beats:
        if "tau" in kind and np.ptp(data.tau[..., j]) == 0:
            continue
        for hertz in np.arange(step, fastest, step):
            rate = 2 * np.pi * float(hertz)
            yield BasisFunction(_beats(kind)(rate), _TIME, 3, "", rate, _beats(kind), np.pi * step)


def _others(data: Quantities, j: int) -> Iterator[BasisFunction]:
    for name in data.joints:
        if name == data.joints[j]:
            continue
        other, on = name if name.isidentifier() else repr(name), (other_joint(name),)
        for text, cost in (
            ("q[{}]", 2),
            ("v[{}]", 2),
            ("tau[{}]", 2),
            ("q[{}]^2", 3),
            ("v[{}]*abs(v[{}])", 3),
            ("q*q[{}]", 4),
        ):
            yield BasisFunction((text.format(other, other),), on, cost)
        yield BasisFunction((f"sin(q[{other}])", f"cos(q[{other}])"), on, 4)
        yield BasisFunction((f"friction(abs(v[{other}]))",), on, 4)


def _tables(data: Quantities, j: int) -> Iterator[BasisFunction]:
    """Heights over one quantity, straight between knots; none over what stands still."""
    return (table for table in _every_table(data, j) if table is not None)


def _every_table(data: Quantities, j: int) -> Iterator[BasisFunction | None]:
    rule = data.thresholds.term_library
    u, tau, own = data.u[..., j], data.tau[..., j], {"q": _POSITION, "v": _VELOCITY}
    if np.ptp(tau) > 0:
        own |= {"tau": _TORQUE} | ({} if np.array_equal(u, tau) else {"u - q": _TARGET})
    for name, on in own.items():
        yield _table(data, j, name, "{}", rule.table_knots, on, 8)
    yield _table(data, j, "t", "{}", rule.table_knots, _TIME, 8)
    yield _table(data, j, "q", "friction({})", rule.friction_knots, _POSITION, 8)
    if np.ptp(tau) > 0:
        yield _table(data, j, "t", "tau*{}", rule.strength_knots, _TIME, 8)
    for name in data.joints:
        if name != data.joints[j]:
            other = name if name.isidentifier() else repr(name)
            for what in ("q", "v"):
                yield _table(data, j, f"{what}[{other}]", "{}", rule.coupling_knots, (other_joint(name),), 9)


def _table(
    data: Quantities, j: int, name: str, frame: str, count: int, on: tuple[str, ...], cost: int
) -> BasisFunction | None:
    """None where the quantity stands still, to the digits that a term is written with."""
    rule, x = data.thresholds.term_library, read_term(name)(data.values(j))
    knots = _written(np.quantile(x, np.linspace(*rule.table_quantiles, count)))
    if len(knots) < _FEWEST_KNOTS:
        knots = _written(np.array([x.min(), x.mean(), x.max()]))
    if len(knots) < 2:
        return None
    rows = [[float(k == i) for k in range(len(knots))] for i in range(len(knots))]
    return BasisFunction(tuple(frame.format(_curve(name, knots, row)) for row in rows), on, cost)


def _written(values: np.ndarray) -> list[float]:
    """The values in order, each once, as `_curve` writes them."""
    return sorted({float(f"{value:.5g}") for value in values})


def _curve(name: str, knots: list[float], heights: list[float]) -> str:
    points = ", ".join(f"{k:.5g}, {h:.5g}" for k, h in zip(knots, heights, strict=True))
    return f"curve({name}, {points})"


def joined(texts: list[str], sizes: np.ndarray) -> tuple[list[str], np.ndarray]:
    """A table's terms as one curve of coefficient 1; formulas as they are."""
    if len(texts) < 2 or not all("curve(" in text for text in texts):
        return texts, sizes
    frame, inner = texts[0].split("curve(", 1)
    name, *points = inner.rstrip(")").rsplit(", ", 2 * len(texts))
    knots = [float(k) for k in points[::2]]
    closing = ")" if frame.endswith("(") else ""
    return [frame + _curve(name, knots, sizes.tolist()) + closing], np.ones(1)


def _beats(frame: str) -> Callable[[float], tuple[str, ...]]:
    return lambda rate: tuple(frame.format(f"{f}({rate:.4g}*t)") for f in ("sin", "cos"))


def _above(edge: float) -> tuple[str, ...]:
    return (f"relu(q - {edge:.3g})".replace("- -", "+ "),)


def _below(edge: float) -> tuple[str, ...]:
    return (f"relu({edge:.3g} - q)",)


def _bound(band: float) -> tuple[str, ...]:
    return (f"bound(u - q, {band:.3g})",)


def _slewed(tick: float) -> Callable[[float], tuple[str, ...]]:
    return lambda rate: (f"slewed({rate:.4g}, {tick:.4g}) - u",)


def _stair(size: float) -> tuple[str, ...]:
    return (f"stair(u, {size:.5g}) - u",)
