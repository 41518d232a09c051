"""The form of a missing torque: sparse regression over a dictionary of formulas, or a measured curve where none fits.

Terms are added one by one (forward stepwise) while the best of them is significant over half-second blocks and the
held-out windows agree. Of terms that explain nearly the same the simplest is taken. Where the formulas reach much less
of the held-out structure than boosted trees do, a curve over the one quantity that says most stands in for them.

The formulas that a missing torque is looked for in, simplest first; the design note's signatures and their kin.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.gap.dependence_test import JointStructure, clipped, gain_test, joint_structure, other_joint
from bumblebee.diagnosis.gap.torque_residual import TorqueResidual
from bumblebee.diagnosis.thresholds.gap import GapThresholds, Library
from bumblebee.sim.effects import Term, read_term


def _uses(*names: str) -> Callable[[Term], bool]:
    return lambda term: any(name in term.names for name in names)


_QUANTITY = {
    "position": _uses("q"),
    "velocity": lambda term: term.rubs or "v" in term.names,
    "target": _uses("u"),
    "torque": _uses("tau"),
    "time": _uses("t"),
}


@dataclass(frozen=True)
class Form:
    """What was found for one joint."""

    joint: str
    terms: dict[str, float]
    """Term -> coefficient, first estimates [N m a unit of the term]; empty where nothing was found."""
    share: float
    """Share of the held-out residual's variance that the terms predict."""
    kind: str
    """"formula", "curve" or ""."""
    p: float = 1.0
    """Of the held-out gain, Bonferroni over the joints."""
    rms: float = 0.0
    """RMS of the prediction [N m]."""


@dataclass(frozen=True, eq=False)
class Entry:
    """A term with its values on the data."""

    text: str
    term: Term
    cost: int
    """Complexity: of two terms that explain the same the cheaper one is named."""


@dataclass(frozen=True, eq=False)
class _Scene:
    """One joint's missing torque: what is fitted, what it is tested on, and what decides."""

    train: TorqueResidual
    held: TorqueResidual
    joint: int
    y: np.ndarray
    """(N,) clipped, on the fitted windows [N m]."""
    target: np.ndarray
    """(M,) clipped, on the held-out windows [N m]."""
    rules: GapThresholds

    def share(self, said: np.ndarray) -> float:
        """Share of the held-out variance that a prediction (M,) explains."""
        left = self.target - said
        return float(1.0 - (left**2).mean() / max(((self.target - self.y.mean()) ** 2).mean(), 1e-30))

    def p(self, said: np.ndarray) -> float:
        """One-sided p that a prediction (M,) says no more than the mean of the fitted windows."""
        return gain_test(self.target - self.y.mean(), self.target - said, self.held.block, self.rules.gain_test)[0]


def examine(
    train: TorqueResidual, held: TorqueResidual, joint: int, rules: GapThresholds | None = None
) -> tuple[JointStructure, Form]:
    """What is left in a joint, by boosted trees or by formulas, whichever sees more; and its form.

    Trees see any shape but do not reach beyond the data that they learned on; formulas do.
    """
    seen = joint_structure(train, held, joint, rules=rules)
    form = find_form(train, held, joint, seen.share, rules)
    p = min(1.0, 2.0 * min(seen.p, form.p))
    if form.p >= seen.p and seen.share >= form.share:
        return replace(seen, p=p), form
    names = [name for name, used in _QUANTITY.items() if any(used(read_term(t)) for t in form.terms)]
    names += [other_joint(other) for t in form.terms for other in read_term(t).others]
    depends = seen.depends_on or tuple(dict.fromkeys(names))
    return replace(seen, p=p, share=form.share, rms=form.rms, depends_on=depends), form


def find_form(
    train: TorqueResidual, held: TorqueResidual, joint: int, reachable: float, rules: GapThresholds | None = None
) -> Form:
    """The form of what is missing on a joint; `reachable` is the held-out share that boosted trees predict."""
    rules = rules or GapThresholds()
    y, target = (clipped(data.missing[:, joint], rules.dependence) for data in (train, held))
    scene, rule = _Scene(train, held, joint, y, target, rules), rules.sparse_regression
    formula = _stepwise(scene)
    share = scene.share(_predicted(formula, scene)) if formula else 0.0
    terms, kind = _coefficients(formula, scene) if formula and share > 0 else {}, "formula"
    if not terms or share < rule.enough * reachable:
        curve = _curve(scene)
        if curve and curve[1] > max(rule.curve_better * share, rule.curve_enough * reachable):
            terms, kind, share = {curve[0]: 1.0}, "curve", curve[1]
    if not terms:
        return Form(held.joints[joint], {}, 0.0, "")
    said = np.sum([c * torque_of(read_term(t), held, joint) for t, c in terms.items()], axis=0)
    rms = float(np.sqrt((said**2).mean()))
    return Form(held.joints[joint], terms, share, kind, min(1.0, scene.p(said) * len(held.joints)), rms)


def _stepwise(scene: _Scene) -> list[Entry]:
    """Terms added one by one while the best is significant and the held-out windows agree."""
    train, rule = scene.train, scene.rules.sparse_regression
    entries = dictionary(train, scene.joint, scene.rules)
    x = np.stack([torque_of(e.term, train, scene.joint) for e in entries])
    chosen: list[int] = []
    before = scene.target.copy()
    while len(chosen) < rule.terms:
        left = scene.y - _fitted(x[chosen], scene.y)
        scores = _scores(x, x[chosen], left, train.block)
        gains = np.where(np.abs(scores[:, 1]) > rule.z, scores[:, 0], 0.0)
        gains[chosen] = 0.0
        if gains.max() <= 0:
            break
        near = np.flatnonzero(gains > rule.nearly * gains.max())
        best = int(min(near, key=lambda k: (entries[k].cost, -gains[k])))
        after = scene.target - _predicted([entries[k] for k in (*chosen, best)], scene)
        p, gain = gain_test(before, after, scene.held.block, scene.rules.gain_test)
        if p > rule.level or gain <= 0:
            break
        chosen.append(best)
        before = after
    return [entries[k] for k in chosen]


def _scores(x: np.ndarray, given: np.ndarray, left: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Of every term given the chosen ones: fall of the squared sum, and z with variance over blocks; (E, 2)."""
    if len(given):
        basis, _ = np.linalg.qr(given.T)
        x = x - (x @ basis) @ basis.T
    power = (x**2).sum(axis=1)
    scale = np.maximum(power, 1e-12 * max(power.max(), 1e-30))
    along = x @ left
    rest = left - (along / scale)[:, None] * x
    blocks = np.stack([np.bincount(block, row * r) for row, r in zip(x, rest, strict=True)])
    spread = np.sqrt((blocks**2).sum(axis=1)) + 1e-30
    return np.stack((along**2 / scale, along / spread), axis=1)


def _fitted(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(x.T, y, rcond=None)[0] @ x if len(x) else np.zeros_like(y)


def _coefficients(entries: list[Entry], scene: _Scene) -> dict[str, float]:
    """Term -> coefficient, by least squares on the fitted windows."""
    x = np.stack([torque_of(e.term, scene.train, scene.joint) for e in entries])
    values = np.linalg.lstsq(x.T, scene.y, rcond=None)[0]
    return {e.text: float(v) for e, v in zip(entries, values, strict=True)}


def _predicted(entries: list[Entry], scene: _Scene) -> np.ndarray:
    """What the terms, fitted, say of the held-out windows (M,)."""
    values = _coefficients(entries, scene)
    return np.sum([values[e.text] * torque_of(e.term, scene.held, scene.joint) for e in entries], axis=0)


def _curve(scene: _Scene) -> tuple[str, float] | None:
    """The best curve over one quantity as a term of coefficient 1, and its held-out share; None if none holds."""
    rule = scene.rules.sparse_regression
    best: tuple[str, float] | None = None
    names = ["q", "v", "u - q", "tau", "t"]
    for other in _others(scene.train, scene.joint):
        names += [f"q[{other}]", f"v[{other}]"]
    for name in names:
        x = read_term(name)(scene.train.values(scene.joint))
        knots = np.unique(np.quantile(x, np.linspace(*rule.knot_ends, rule.knots)))
        if len(knots) < 3:
            continue
        heights = np.linalg.lstsq(_hats(x, knots), scene.y, rcond=None)[0]
        points = ", ".join(f"{k:.5g}, {h:.5g}" for k, h in zip(knots, heights, strict=True))
        text = f"curve({name}, {points})"
        said = read_term(text)(scene.held.values(scene.joint))
        share = scene.share(said)
        if scene.p(said) < rule.level / len(names) and (best is None or share > best[1]):
            best = text, share
    return best


def _hats(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Weights (N, K) of the knots in straight lines between them, constant beyond."""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def dictionary(data: TorqueResidual, joint: int, rules: GapThresholds | None = None) -> list[Entry]:
    """Terms for one joint (an index), whose scales come from the data."""
    rules = rules or GapThresholds()
    found = [*_plain_terms(data, joint), *_scaled_terms(data, joint, rules), *_terms_of_others(data, joint)]
    text = [t.replace("- -", "+ ") for t, _ in found]
    entries = [Entry(t, read_term(t), cost) for t, (_, cost) in zip(text, found, strict=True)]
    return [e for e in entries if np.isfinite(torque_of(e.term, data, joint)).all()]


def _plain_terms(data: TorqueResidual, joint: int) -> list[tuple[str, int]]:
    """Terms without a scale, and their complexity."""
    found: list[tuple[str, int]] = [("1", 1), ("q", 1), ("v", 1), ("friction(1)", 1), ("tau", 1), ("t", 1)]
    found += [
        ("q^2", 2),
        ("q^3", 2),
        ("sin(q)", 2),
        ("cos(q)", 2),
        ("v*abs(v)", 2),
        ("v^3", 3),
        ("q*v", 3),
        ("v*q^2", 4),
    ]
    found += [("friction(abs(tau))", 2), ("friction(abs(q))", 3), ("friction(q^2)", 3), ("friction(t)", 3)]
    found += [("t*tau", 3), ("t*v", 3), ("t*q", 4), ("abs(tau)", 3), ("tau*abs(tau)", 3), ("tau*abs(v)", 3)]
    if np.ptp(data.u[:, joint]) > 0:
        found += [("u - q", 2), ("(u - q)^3", 3)]
    return found


def _scaled_terms(data: TorqueResidual, joint: int, rules: GapThresholds) -> list[tuple[str, int]]:
    """Terms with a scale that the data give, and their complexity: Stribeck friction, waves, one-sided springs."""
    rule, q, v = rules.library, data.q[:, joint], data.v[:, joint]
    travel, speed = float(np.ptp(q)), float(np.sqrt((v**2).mean())) + 1e-9
    found = [(f"friction(exp(-(v/{share * speed:.3g})^2))", 3) for share in rule.stribeck]
    for n in rule.harmonics:
        # Several waves, and not blurred within a window.
        if n * travel > np.pi and n * speed * rules.missing_torque.span < rule.blur:
            found += [(f"sin({n}*q)", 3), (f"cos({n}*q)", 3)]
            if n <= rule.friction_harmonic:
                found += [(f"friction(1 + sin({n}*q))", 4), (f"friction(1 + cos({n}*q))", 4)]
    return [*found, *_edge_terms(data, joint, rule)]


def _edge_terms(data: TorqueResidual, joint: int, rule: Library) -> list[tuple[str, int]]:
    """Terms that begin at a position or a torque, and their complexity."""
    q, tau = data.q[:, joint], data.tau[:, joint]
    found: list[tuple[str, int]] = []
    for share in rule.stops:
        edge = float(np.quantile(q, share))
        found += [(f"relu(q - {edge:.3g})", 4), (f"friction(relu(q - {edge:.3g}))", 5)]
        found += [(f"relu({edge:.3g} - q)", 4), (f"friction(relu({edge:.3g} - q))", 5)]
    for share in rule.torque_edges:
        edge = float(np.quantile(np.abs(tau), share))
        found.append((f"relu(tau - {edge:.3g}) - relu(-tau - {edge:.3g})", 4))
    return found


def _terms_of_others(data: TorqueResidual, joint: int) -> list[tuple[str, int]]:
    """Terms of the other joints' motion, and their complexity."""
    found: list[tuple[str, int]] = []
    for other in _others(data, joint):
        found += [(f"q[{other}]", 2), (f"v[{other}]", 2), (f"sin(q[{other}])", 3), (f"q*q[{other}]", 4)]
        found += [(f"v*abs(v[{other}])", 5), (f"friction(abs(v[{other}]))", 5), (f"v[{other}]*abs(v[{other}])", 4)]
    return found


def _others(data: TorqueResidual, joint: int) -> list[str]:
    """Names of the other joints as a term has them."""
    names = [name for name in data.joints if name != data.joints[joint]]
    return [name if name.isidentifier() else repr(name) for name in names]


def torque_of(term: Term, data: TorqueResidual, joint: int) -> np.ndarray:
    """The term's torque (N,) on the data for coefficient 1; dry friction against the direction of motion."""
    value = np.broadcast_to(term(data.values(joint)), len(data)).astype(float)
    if not term.rubs:
        return value
    return -np.maximum(value, 0.0) * np.tanh(data.v[:, joint] / data.creep[joint])
