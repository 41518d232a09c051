"""Terminal and run sheet count the same pairs, each once for both of its directions."""

import re

import pytest

from bumblebee.diagnosis.plan.predicted import pairs
from bumblebee.diagnosis.plan.written.document import document
from bumblebee.diagnosis.plan.written.sheet import sheet
from bumblebee.diagnosis.plan.written.terminal import summary
from tests.diagnosis.plan.made import planned


def row(one: str, other: str, chi2: float, before: bool, after: bool) -> dict:
    """A row of `classes`: one effect is there, the other is fitted."""
    labels = [{"effect": name, "where": ["j"]} for name in (one, other)]
    return {"class": "c", "if": labels[0], "not": labels[1], "chi2": {"before": 0.0, "after": chi2},
            "cosine": {"before": 1.0, "after": 0.5}, "resolved": {"before": before, "after": after}}  # fmt: skip


def test_a_pair_is_told_apart_where_both_directions_are_and_the_harder_one_is_shown() -> None:
    rows = [row("kp", "kd", 50.0, True, True), row("kd", "kp", 20.0, False, True),
            row("kp", "spring", 9.0, False, True), row("spring", "kp", 12.0, False, False)]  # fmt: skip
    first, second = pairs(rows)
    assert (first["if"]["effect"], first["chi2"]["after"]) == ("spring", 12.0)
    assert first["resolved"] == {"before": False, "after": False}
    assert (second["if"]["effect"], second["resolved"]) == ("kd", {"before": False, "after": True})


@pytest.mark.parametrize("damping", [False, True])
def test_the_terminal_counts_what_the_sheet_counts(damping: bool) -> None:
    plan = planned(damping)
    told = document(plan, "")
    count, expected = re.search(r"pairs told apart: \d+ of (\d+) now, (\d+) expected", summary(told)).groups()
    total, left = re.search(r"of (\d+) pairs (\d+) not expected to be told apart", sheet(plan, told)).groups()
    assert int(count) == int(total) < len(told["predicted"]["classes"])
    assert int(expected) == int(total) - int(left)
