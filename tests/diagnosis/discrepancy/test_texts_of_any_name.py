"""Texts of terms over joints of any name: a table becomes one curve, its numbers are counted, its points are cut."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.formula import formula
from bumblebee.diagnosis.comparison.information_criterion import numbers
from bumblebee.diagnosis.discrepancy.term_library import joined
from bumblebee.sim.effects import TABLE, read_term

NAMES = ["elbow", "elbow(2)", "a, b", "curve(2)", "it's", "j^2"]


@pytest.mark.parametrize("frame", ["{}", "friction({})", "tau*{}"])
@pytest.mark.parametrize("name", NAMES)
def test_a_table_over_a_joint_of_any_name_is_one_curve(name: str, frame: str) -> None:
    other = f"q[{name if name.isidentifier() else repr(name)}]"
    texts = [frame.format(f"curve({other}, -1, {a}, 0.5, {b}, 2, {c})") for a, b, c in np.eye(3)]
    (text,), size = joined(texts, np.array([0.3, -0.2, 1e-5]))
    assert text == frame.format(f"curve({other}, -1, 0.3, 0.5, -0.2, 2, 1e-05)") and size.tolist() == [1.0]
    assert read_term(text).others == (name,)
    assert TABLE.sub(r"curve(\1, ...)", text) == frame.format(f"curve({other}, ...)")


@pytest.mark.parametrize("name", NAMES)
def test_a_number_in_a_joint_s_name_is_no_number_of_the_law(name: str) -> None:
    other = f"q[{name if name.isidentifier() else repr(name)}]"
    assert numbers(formula("j1", {f"sin(3*{other})": 1.0})) == 2
    assert numbers(formula("j1", {f"curve({other}, -1, 0.3, 0.5, -0.2, 2, 1e-05)": 1.0})) == 3
