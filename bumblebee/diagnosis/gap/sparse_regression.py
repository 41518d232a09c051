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
from bumblebee.sim.effects import Term, read_term

MOST_TERMS = 3
_Z = 4.5  # of a term over blocks; a hundred terms are looked at
_NEARLY = 0.95  # share of the best term's gain that a simpler one must reach
_ENOUGH = 0.6  # share of the trees' held-out gain that counts as the form being found
_KNOTS = 9


def _uses(*names: str) -> Callable[[Term], bool]:
    return lambda term: any(name in term.names for name in names)


_QUANTITY = {
    "position": _uses("q"),
    "velocity": lambda term: term.rubs or "v" in term.names,
    "target": _uses("u"),
    "torque": _uses("tau"),
    "time": _uses("t"),
}
_HARMONICS = (2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 24, 28, 30, 32, 36, 40, 42, 48, 56, 60, 64, 72, 84, 96)


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


def examine(train: TorqueResidual, held: TorqueResidual, joint: int) -> tuple[JointStructure, Form]:
    """What is left in a joint, by boosted trees or by formulas, whichever sees more; and its form.

    Trees see any shape but do not reach beyond the data that they learned on; formulas do.
    """
    seen = joint_structure(train, held, joint)
    form = find_form(train, held, joint, seen.share)
    p = min(1.0, 2.0 * min(seen.p, form.p))
    if form.p >= seen.p and seen.share >= form.share:
        return replace(seen, p=p), form
    names = [name for name, used in _QUANTITY.items() if any(used(read_term(t)) for t in form.terms)]
    names += [other_joint(other) for t in form.terms for other in read_term(t).others]
    depends = seen.depends_on or tuple(dict.fromkeys(names))
    return replace(seen, p=p, share=form.share, rms=form.rms, depends_on=depends), form


def find_form(train: TorqueResidual, held: TorqueResidual, joint: int, reachable: float) -> Form:
    """The form of what is missing on a joint; `reachable` is the held-out share that boosted trees predict."""
    y, target = clipped(train.missing[:, joint]), clipped(held.missing[:, joint])
    formula = _stepwise(train, held, joint, y, target)
    share = _share(formula, train, held, joint, target, y)
    terms, kind = _coefficients(formula, train, joint, y) if formula and share > 0 else {}, "formula"
    if not terms or share < _ENOUGH * reachable:
        curve = _curve(train, held, joint, y, target)
        if curve and curve[1] > max(1.1 * share, 0.2 * reachable):
            terms, kind, share = {curve[0]: 1.0}, "curve", curve[1]
    if not terms:
        return Form(held.joints[joint], {}, 0.0, "")
    said = np.sum([c * torque_of(read_term(t), held, joint) for t, c in terms.items()], axis=0)
    p, _ = gain_test(target - y.mean(), target - said, held.block)
    rms = float(np.sqrt((said**2).mean()))
    return Form(held.joints[joint], terms, share, kind, min(1.0, p * len(held.joints)), rms)


@dataclass(frozen=True, eq=False)
class Entry:
    """A term with its values on the data."""

    text: str
    term: Term
    cost: int
    """Complexity: of two terms that explain the same the cheaper one is named."""


def _stepwise(
    train: TorqueResidual, held: TorqueResidual, joint: int, y: np.ndarray, target: np.ndarray
) -> list[Entry]:
    entries = dictionary(train, joint)
    x = np.stack([torque_of(e.term, train, joint) for e in entries])
    chosen: list[int] = []
    before = target.copy()
    while len(chosen) < MOST_TERMS:
        left = y - _fitted(x[chosen], y)
        scores = _scores(x, x[chosen], left, train.block)
        gains = np.where(np.abs(scores[:, 1]) > _Z, scores[:, 0], 0.0)
        gains[chosen] = 0.0
        if gains.max() <= 0:
            break
        near = np.flatnonzero(gains > _NEARLY * gains.max())
        best = int(min(near, key=lambda k: (entries[k].cost, -gains[k])))
        trial = [entries[k] for k in (*chosen, best)]
        after = target - _predicted(trial, train, held, joint, y)
        p, gain = gain_test(before, after, held.block)
        if p > 0.01 or gain <= 0:
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


def _coefficients(entries: list[Entry], train: TorqueResidual, joint: int, y: np.ndarray) -> dict[str, float]:
    x = np.stack([torque_of(e.term, train, joint) for e in entries])
    values = np.linalg.lstsq(x.T, y, rcond=None)[0]
    return {e.text: float(v) for e, v in zip(entries, values, strict=True)}


def _predicted(
    entries: list[Entry], train: TorqueResidual, held: TorqueResidual, joint: int, y: np.ndarray
) -> np.ndarray:
    values = _coefficients(entries, train, joint, y)
    return np.sum([values[e.text] * torque_of(e.term, held, joint) for e in entries], axis=0)


def _share(
    entries: list[Entry],
    train: TorqueResidual,
    held: TorqueResidual,
    joint: int,
    target: np.ndarray,
    y: np.ndarray,
) -> float:
    if not entries:
        return 0.0
    left = target - _predicted(entries, train, held, joint, y)
    return float(1.0 - (left**2).mean() / max(((target - y.mean()) ** 2).mean(), 1e-30))


def _curve(
    train: TorqueResidual, held: TorqueResidual, joint: int, y: np.ndarray, target: np.ndarray
) -> tuple[str, float] | None:
    """The best curve over one quantity as a term of coefficient 1, and its held-out share; None if none holds."""
    best: tuple[str, float] | None = None
    names = ["q", "v", "u - q", "tau", "t"]
    for name in train.joints:
        if name != train.joints[joint]:
            other = name if name.isidentifier() else repr(name)
            names += [f"q[{other}]", f"v[{other}]"]
    for name in names:
        x = read_term(name)(train.values(joint))
        knots = np.unique(np.quantile(x, np.linspace(0.02, 0.98, _KNOTS)))
        if len(knots) < 3:
            continue
        heights = np.linalg.lstsq(_hats(x, knots), y, rcond=None)[0]
        points = ", ".join(f"{k:.5g}, {h:.5g}" for k, h in zip(knots, heights, strict=True))
        text = f"curve({name}, {points})"
        left = target - read_term(text)(held.values(joint))
        share = float(1.0 - (left**2).mean() / max(((target - y.mean()) ** 2).mean(), 1e-30))
        p, _ = gain_test(target - y.mean(), left, held.block)
        if p < 0.01 / len(names) and (best is None or share > best[1]):
            best = text, share
    return best


def _hats(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Weights (N, K) of the knots in straight lines between them, constant beyond."""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def dictionary(data: TorqueResidual, joint: int) -> list[Entry]:
    """Terms for one joint (an index), whose scales come from the data."""
    q, v, tau = data.q[:, joint], data.v[:, joint], data.tau[:, joint]
    travel, speed = float(np.ptp(q)), float(np.sqrt((v**2).mean())) + 1e-9
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
    for share in (0.3, 1.0):
        found.append((f"friction(exp(-(v/{share * speed:.3g})^2))", 3))
    for n in _HARMONICS:
        if n * travel > np.pi and n * speed * 0.04 < 2.0:  # several waves, and not blurred within a window
            found += [(f"sin({n}*q)", 3), (f"cos({n}*q)", 3)]
            if n <= 8:
                found += [(f"friction(1 + sin({n}*q))", 4), (f"friction(1 + cos({n}*q))", 4)]
    for share in (0.25, 0.5, 0.75):
        edge = float(np.quantile(q, share))
        found += [(f"relu(q - {edge:.3g})", 4), (f"friction(relu(q - {edge:.3g}))", 5)]
        found += [(f"relu({edge:.3g} - q)", 4), (f"friction(relu({edge:.3g} - q))", 5)]
    for share in (0.5, 0.8):
        edge = float(np.quantile(np.abs(tau), share))
        found.append((f"relu(tau - {edge:.3g}) - relu(-tau - {edge:.3g})", 4))
    for name in data.joints:
        if name != data.joints[joint]:
            other = name if name.isidentifier() else repr(name)
            found += [(f"q[{other}]", 2), (f"v[{other}]", 2), (f"sin(q[{other}])", 3), (f"q*q[{other}]", 4)]
            found += [(f"v*abs(v[{other}])", 5), (f"friction(abs(v[{other}]))", 5), (f"v[{other}]*abs(v[{other}])", 4)]
    text = [t.replace("- -", "+ ") for t, _ in found]
    entries = [Entry(t, read_term(t), cost) for t, (_, cost) in zip(text, found, strict=True)]
    return [e for e in entries if np.isfinite(torque_of(e.term, data, joint)).all()]


def torque_of(term: Term, data: TorqueResidual, joint: int) -> np.ndarray:
    """The term's torque (N,) on the data for coefficient 1; dry friction against the direction of motion."""
    value = np.broadcast_to(term(data.values(joint)), len(data)).astype(float)
    if not term.rubs:
        return value
    return -np.maximum(value, 0.0) * np.tanh(data.v[:, joint] / data.creep[joint])
