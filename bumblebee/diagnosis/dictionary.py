"""The formulas that a missing torque is looked for in, simplest first; the design note's signatures and their kin."""

from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.torque_residual import TorqueResidual
from bumblebee.sim.effect_terms import Term, read_term

_HARMONICS = (2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 24, 28, 30, 32, 36, 40, 42, 48, 56, 60, 64, 72, 84, 96)


@dataclass(frozen=True, eq=False)
class Entry:
    """A term with its values on the data."""

    text: str
    term: Term
    cost: int
    """Complexity: of two terms that explain the same the cheaper one is named."""


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
