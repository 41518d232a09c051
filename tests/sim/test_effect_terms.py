"""Formulas of discovered effects: what they mean, and that nothing else can be written in them."""

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.sim.effects import read_term

RNG = np.random.default_rng(0)
VALUES = {name: RNG.uniform(-2, 2, 50) for name in ("q", "v", "u", "tau", "t", "q[knee]", "v[left knee]")}


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("sin(12*q)", lambda x: np.sin(12 * x["q"])),
        ("q^3 - 2*v/5", lambda x: x["q"] ** 3 - 0.4 * x["v"]),
        ("-abs(tau)*sign(v)", lambda x: -np.abs(x["tau"]) * np.sign(x["v"])),
        ("relu(u - q)", lambda x: np.maximum(x["u"] - x["q"], 0)),
        ("exp(-(v/0.1)^2)*t", lambda x: np.exp(-((x["v"] / 0.1) ** 2)) * x["t"]),
        ("q*q[knee] + v['left knee']", lambda x: x["q"] * x["q[knee]"] + x["v[left knee]"]),
        ("curve(q, -1, 2, 0, 0, 1.5, -3)", lambda x: np.interp(x["q"], [-1, 0, 1.5], [2, 0, -3])),
    ],
)
def test_a_term_means_what_it_says(text: str, meant: object) -> None:
    np.testing.assert_allclose(read_term(text)(VALUES), meant(VALUES), rtol=1e-12)


def test_friction_is_a_loss_and_other_joints_are_named() -> None:
    assert read_term("friction(1 + cos(q))").rubs and not read_term("cos(q)").rubs
    assert read_term("q[knee]*v['left knee']").others == ("knee", "left knee")


@pytest.mark.parametrize(
    "text",
    ["__import__('os')", "q.real", "x", "sin(q, v)", "q^0.5", "q**99", "lambda: 1", "[q]", "open('x')", "q if v else u",
     "curve(q, 0, 1)", "curve(q, 1, 0, 0, 0)", "(" * 500, "q[0]", "u[knee]", "friction(q, v)", "", "1e400", "q" * 3000],
)  # fmt: skip
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(BadInput):
        read_term(text)


@pytest.mark.parametrize("name", ["elbow(1)", "a, b", "it's", 'say "j"', "curve(q, 1, 2)", "[0]", "j^2", "back\\slash"])
def test_a_joint_may_have_any_name(name: str) -> None:
    values = VALUES | {f"q[{name}]": VALUES["u"]}
    term = read_term(f"q^2 + q[{name!r}]")
    assert term.others == (name,)
    np.testing.assert_allclose(term(values), values["q"] ** 2 + values["u"], rtol=1e-12)
