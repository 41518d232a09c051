"""Checks of time: order, duplicates, gaps, jitter, a clock that drifts, and a rate that is not `control_hz`."""

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
    _check_gaps(view, np.diff(view.rollout.time), period)
    _check_jitter(view, steps[steps < view.limits.gap_warn * period], period)
    _check_drift(view, steps[steps < view.limits.gap_warn * period])


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
    if fatal and longest > limits.gap_episode:
        came += " (several recordings in one file? `episode` in the import's map tells them apart)"
    row = int(np.argmax(steps)) + 1 if fatal else int(np.argmax(gaps)) + 1
    view.add("time", row, "time-gap", f"a row every {period:.4g} s", came, fatal=fatal)


def _check_jitter(view: View, steps: np.ndarray, period: float) -> None:
    spread = float(steps.std()) / period
    if spread > view.limits.jitter_warn:
        came = f"a spread of {100 * spread:.0f} % of the period"
        expected = f"periods within {100 * view.limits.jitter_warn:.0f} %"
        view.add("time", None, "time-jitter", expected, came, fatal=spread > view.limits.jitter_fatal)


def _check_drift(view: View, steps: np.ndarray) -> None:
    """The period at the file's end against that at its beginning: a clock that runs ever slower or faster."""
    part = len(steps) // 4
    if part < 20:
        return
    first, last = float(np.mean(steps[:part])), float(np.mean(steps[-part:]))
    doubt = 3.0 * float(steps.std()) * np.sqrt(2.0 / part)
    change = last / first - 1
    if abs(last - first) > doubt and abs(change) > view.limits.drift_warn:
        came = f"{1e3 * first:.4g} ms in the first quarter, {1e3 * last:.4g} ms in the last ({100 * change:+.1f} %)"
        fatal = abs(change) > view.limits.drift_fatal
        view.add("time", len(steps) - part, "time-drift", "one period throughout", came, fatal=fatal)
