"""A discovered effect in the simulator against the same formula integrated in NumPy, and its file."""

from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect, read_effects, runtime_hooks
from tests.sim.hinge import both, close, model_with, path, reference, servo, sign, swing


@pytest.mark.parametrize(
    ("terms", "torque"),
    [
        (
            {"sin(5*q)": 0.8, "q^3": -9.0},
            lambda t, q, v: servo(t, q, v) + 0.8 * np.sin(5 * q) - 9 * q**3,
        ),
        (
            {"friction(1 + 2*abs(q))": 0.4},
            lambda t, q, v: servo(t, q, v) - 0.4 * (1 + 2 * abs(q)) * sign(v),
        ),
        (
            {"u - q": -4.0, "t*tau": -0.8},
            lambda t, q, v: servo(t, q, v) * (1 - 0.8 * t) - 4 * (swing(t) - q),
        ),
        (
            {"curve(v, -1, 0.6, 0, 0, 1, -0.6)": 1.0},
            lambda t, q, v: servo(t, q, v) - 0.6 * np.clip(v, -1, 1),
        ),
    ],
    ids=["position", "friction", "target, torque and time", "curve"],
)
def test_terms_act_as_their_formula(terms: dict[str, float], torque: object) -> None:
    plain, without = both()
    close(path([Effect("discovered", ("j",), terms)], swing), plain, reference(torque), without)


def test_a_term_of_a_joint_that_is_not_there_is_refused() -> None:
    with pytest.raises(BadInput, match="elbow"):
        runtime_hooks([Effect("discovered", ("j",), {"q[elbow]": 1.0})], model_with())


@pytest.mark.parametrize(
    "parameters",
    ["{}", "{terms: []}", "{terms: [{term: q}]}", "{terms: [{term: 'open(q)', coefficient: 1}]}",
     "{terms: [{term: q, coefficient: .inf}]}", "{terms: [{term: q, coefficient: 1, more: 2}]}", "{stiffness: 1}"],
)  # fmt: skip
def test_a_wrong_discovered_entry_is_named(tmp_path: Path, parameters: str) -> None:
    file = tmp_path / "effects.yaml"
    file.write_text(f"schema: 1\neffects: [{{effect: discovered, where: [j], parameters: {parameters}}}]")
    with pytest.raises(BadInput, match=r"effects|term"):
        read_effects(file)
