"""Numbers that carry their half and double: results stay the same, and what they decide is counted."""

import pickle
from copy import deepcopy

import numpy as np
import pandas as pd
import pytest

from benchmarks.diagnosis import threshold_day as day


@pytest.fixture(autouse=True)
def fresh():
    day.counts.clear()


def number(value, name="x"):
    half = value // 2 if isinstance(value, int) else value / 2
    return day.carry(value, {name: (half, 2 * value)})


def told(name="x"):
    return {column: day.counts[name, column] for column in day.COUNTS}


def test_a_comparison_that_the_half_turns_is_counted_and_answered_as_before():
    assert (number(0.4) > 0.3) is True
    assert (number(0.4) > 0.1) is True
    assert (number(0.4) <= np.float64(0.5)) == np.True_
    assert told() == {"read": 3, "seen": 3, "compared": 3, "half": 1, "double": 1, "array": 0}


def test_scalars_carry_through_arithmetic_to_the_comparison():
    for bound in (2.0 * number(0.4) + 1.0, np.float64(2.0) * number(0.4) + 1.0, 1.0 + 2.0 * number(0.4)):
        assert bound == pytest.approx(1.8)
    day.counts.clear()
    assert np.float64(2.0) * number(0.4) + 1.0 > 1.5
    assert told() == {"read": 3, "seen": 3, "compared": 1, "half": 1, "double": 0, "array": 0}


def test_two_numbers_in_one_decision_are_tried_one_at_a_time():
    assert number(3.0, "a") > number(2.0, "b")
    assert (told("a")["half"], told("a")["double"]) == (1, 0)
    assert (told("b")["half"], told("b")["double"]) == (0, 1)


def test_arrays_are_compared_element_by_element_and_what_enters_them_is_said():
    values = np.array([0.1, 0.3])
    assert (values < number(0.2)).tolist() == [True, False]
    assert told() == {"read": 1, "seen": 1, "compared": 1, "half": 1, "double": 1, "array": 0}
    assert np.minimum(values, number(5.0, "y")).tolist() == [0.1, 0.3]
    assert (told("y")["compared"], told("y")["half"], told("y")["double"], told("y")["array"]) == (1, 0, 0, 0)
    made = values * number(2.0, "z")
    assert type(made) is np.ndarray and made.tolist() == [0.2, 0.6] and told("z")["array"] == 1
    for use in (float, int, "{:.1f}".format):
        before = told("z")["array"]
        assert use(number(2.0, "z")) == use(2.0) and told("z")["array"] == before + 1


def test_a_use_that_cannot_be_seen_leaves_the_number_among_those_that_enter(tmp_path):
    assert list(range(number(3))) == [0, 1, 2]
    assert told()["seen"] < told()["read"]
    rows = [("Backlash.deepest", 1, 1, 1, 0, 0, 0), ("Validation.z", 1, 0, 0, 0, 0, 0), ("Later.z", 1, 1, 1, 1, 0, 0)]
    pd.DataFrame(rows, columns=["number", *day.COUNTS]).to_csv(tmp_path / "a.csv", index=False)
    says = day.table([tmp_path])["says"]
    assert (says["Validation.z"], says["Later.z"], says["Later.growth"]) == ("enters", "decides", "never read")


@pytest.mark.parametrize("line", [[], ["out", "--times", "2"], ["out", "--of", "x.csv"], ["--table", "."]])
def test_options_that_say_nothing_to_do_are_one_line(line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert day.main(line) == 2
    assert capsys.readouterr().err.count("\n") == 1 and list(tmp_path.iterdir()) == []


def test_carriers_leave_a_process_and_a_copy_as_plain_numbers():
    for value in (number(0.5), number(7), day.carry(np.float64(0.5), {"x": (0.25, 1.0)})):
        for left in (pickle.loads(pickle.dumps(value)), deepcopy(value)):
            assert type(left) in (float, int, np.float64) and left == value
    assert sorted(day.numbers())[0].count(".") == 1 and len(day.numbers()) > 100
