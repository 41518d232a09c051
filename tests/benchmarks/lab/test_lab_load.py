"""The load's figures: quantiles, errors apart from answers, and requests that name what is known."""

import random

from benchmarks.lab_load.table import quantile, row, table
from benchmarks.lab_load.users import Known, Sample, look_ups

KNOWN = Known("7", ("run1", "run2"), "policy/policy.onnx", ("expert-c0",), ("flow1",))


def test_a_quantile_is_a_value_that_was_measured() -> None:
    values = [float(n) for n in range(1, 101)]
    assert (quantile(values, 0.5), quantile(values, 0.99), quantile([3.0], 0.99)) == (50.0, 99.0, 3.0)


def test_what_failed_is_counted_and_is_no_fast_answer() -> None:
    samples = [Sample("ours", "x", 0.1, ""), Sample("ours", "x", 0.0001, "status 500")]
    assert row(samples) == ["100", "100", "2", "1"]
    assert row(samples[1:]) == ["-", "-", "1", "1"]


def test_the_table_has_a_row_for_each_kind_and_one_for_all() -> None:
    samples = [Sample("ours", "a", 0.01, ""), Sample("plain", "b", 0.02, "")]
    lines = table(samples, ["ours", "plain"]).splitlines()
    assert [line.split(" | ")[0] for line in lines[2:]] == ["| a", "| b", "| all"]
    assert lines[4] == "| all | 10 | 10 | 1 | 0 | 20 | 20 | 1 | 0 |"


def test_users_ask_only_for_what_is_there_and_equal_seeds_ask_the_same() -> None:
    asked = look_ups(KNOWN, random.Random(1))
    assert asked == look_ups(KNOWN, random.Random(1))
    paths = [request.path for requests in asked.values() for request in requests]
    assert any("expert-c0" in path for path in paths) and any("flow1" in path for path in paths)
