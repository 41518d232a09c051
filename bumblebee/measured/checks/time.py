"""Checks of time: order, duplicates, gaps, jitter, a clock that drifts, several rates, one that is not `control_hz`."""

import numpy as np

from bumblebee.measured.checks.view import View


def check_time(view: View) -> None:
    """Time stamps against themselves and against the declared rate."""
    steps = np.diff(view.rollout.time)
    for rule, wrong, came in (
        ("time-duplicate", steps == 0, "the same time twice"),
        ("time-order", steps < 0, "a time before the one above it"),
    ):
        if wrong.any():
            text = f"{came} ({int(wrong.sum())} times in all)"
            view.add("time", np.argmax(wrong) + 1, rule, "strictly increasing time", text, fatal=True)
    steps = steps[steps > 0]
    if len(steps) == 0:
        return
    period = float(np.median(steps))
    _check_rate(view, period)
    _check_drift(view, steps)
    if any(finding.rule == "time-drift" and finding.fatal for finding in view.findings):
        return  # gaps and jitter are told by the period, of which there are several
    _check_gaps(view, np.diff(view.rollout.time), period)
    _check_jitter(view, steps[steps < view.limits.gap_warn * period], period)


def _check_rate(view: View, period: float) -> None:
    limits, rate, declared = view.limits, 1 / period, view.rollout.control_hz
    error = abs(rate / declared - 1)
    if error <= limits.rate_warn:
        return
    hint = ""
    for unit, factor in (("milliseconds", 1e3), ("microseconds", 1e6), ("nanoseconds", 1e9)):
        if abs(rate * factor / declared - 1) < limits.rate_fatal:
            hint = f": these are {unit}"
    came = f"a median period of {period:.6g} s = {rate:.4g} Hz{hint}"
    view.add("time", None, "rate", f"control_hz = {declared:g} Hz", came, fatal=error > limits.rate_fatal)


def _check_gaps(view: View, steps: np.ndarray, period: float) -> None:
    limits = view.limits
    gaps = steps > limits.gap_warn * period
    if not gaps.any():
        return
    longest = float(steps.max())
    missing = float((steps[gaps] / period - 1).sum()) / len(steps)
    came = f"{int(gaps.sum())} gaps, the longest {longest:.4g} s = {longest / period:.1f} periods"
    fatal = longest > limits.gap_fatal * period or missing > limits.gap_share_fatal
    row = int(np.argmax(steps)) + 1 if fatal else int(np.argmax(gaps)) + 1
    view.add("time", row, "time-gap", f"a row every {period:.4g} s", came, fatal=fatal)


def _check_jitter(view: View, steps: np.ndarray, period: float) -> None:
    spread = float(steps.std()) / period
    if spread > view.limits.jitter_warn:
        came = f"a spread of {100 * spread:.0f} % of the period"
        expected = f"periods within {100 * view.limits.jitter_warn:.0f} %"
        view.add("time", None, "time-jitter", expected, came, fatal=spread > view.limits.jitter_fatal)


def _check_drift(view: View, steps: np.ndarray) -> None:
    """The periods of up to eight parts of the file: a clock that runs ever slower, or several rates."""
    count = min(8, len(steps) // 20)
    if count < 4:
        return
    parts = [part[part < view.limits.gap_warn * np.median(part)] for part in np.array_split(steps, count)]
    periods = np.array([part.mean() for part in parts])
    doubt = 3.0 * float(np.sqrt(np.mean([part.var() for part in parts]))) * np.sqrt(2.0 * count / len(steps))
    change = float(periods.max() / periods.min() - 1)
    if np.ptp(periods) > doubt and change > view.limits.drift_warn:
        shown = ", ".join(f"{1e3 * period:.4g}" for period in periods)
        came = f"{shown} ms in its {count} parts ({100 * change:.1f} % apart)"
        fatal = change > view.limits.drift_fatal
        came += ": import what was logged at each rate as a file of its own" * fatal
        row = int(np.argmax(np.abs(periods - periods[0]))) * len(steps) // count
        view.add("time", row, "time-drift", "one period throughout", came, fatal=fatal)
