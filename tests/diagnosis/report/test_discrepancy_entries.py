"""Measured curves of a missing torque."""

import numpy as np

from bumblebee.diagnosis.report.discrepancy_entries import measured_curve
from bumblebee.diagnosis.report.page import _effects
from bumblebee.diagnosis.report.terminal import _grouped
from bumblebee.diagnosis.thresholds.report import MeasuredCurve, ReportThresholds


def test_a_measured_curve_is_the_mean_with_an_interval_that_covers() -> None:
    rng = np.random.default_rng(3)
    x = rng.uniform(-2.0, 2.0, 1500)
    y = -0.5 * np.tanh(4 * x) + 0.3 * rng.standard_normal(1500)
    rows = np.array(measured_curve(x, y, np.arange(1500) // 12, MeasuredCurve()))
    off = np.abs(rows[:, 1] + 0.5 * np.tanh(4 * rows[:, 0]))
    assert len(rows) == 15 and (off < rows[:, 2]).mean() > 0.8


def test_what_lies_in_one_block_counts_once() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-1.0, 1.0, 300), rng.standard_normal(300)
    alone, blocks = (np.array(measured_curve(x, y, b, MeasuredCurve(3))) for b in (np.arange(300), np.arange(300) % 5))
    np.testing.assert_array_equal(alone[:, :2], blocks[:, :2])
    assert (blocks[:, 2] > 3 * alone[:, 2]).all()


def test_no_number_of_a_law_is_cut_in_terminal_and_page() -> None:
    points = ", ".join(f"{0.12345 * k - 1.5:.5f}, {0.05432 * k:.5f}" for k in range(1, 12))
    terms = [{"term": f"curve(v, {points})", "coefficient": 1.0, "ci95": [0.9, 1.1]}]
    made = {
        "effects": [{"effect": "discovered", "where": ["j"], "parameters": {"terms": terms}, "equivalent": [],
                     "explains": 0.5, "evidence": {"p": 0.0}}],
        "unexplained": {"significant": False, "p": 0.4, "where": [], "depends_on": [], "description": ""},
        "error": {"before": {}, "after": {}, "floor": {}},
        "holdout": ["a"],
    }  # fmt: skip
    for text in (_effects(made, ReportThresholds()), "\n".join(_grouped(made, ReportThresholds()))):
        shown = text.split("curve(v, ")[1].split(", ...)")[0].split(", ")
        assert len(shown) > 3 and shown == points.split(", ")[: len(shown)]
