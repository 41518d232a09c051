"""The joint error on held-out rollouts, before and after, beside its noise floor."""

from bumblebee.report import noise_floor
from bumblebee.report.charts.residual_chart import value_and_interval
from bumblebee.report.results import Json, RoundResults
from bumblebee.report.wording import number, plural

_HORIZON = "0.2"  # s, where the diagnosis has it


def joint_error(turn: RoundResults) -> tuple[str, dict[str, Json]] | None:
    """The horizon to tell about [s], and the joint position error [rad] there before, after, and of the noise alone."""
    error = turn.diagnosis["error"]
    horizon = _HORIZON if _HORIZON in error["before"] else next(iter(error["before"]), "")
    names = ("before", "after", "floor")
    return (horizon, {name: error[name][horizon]["joint_pos_rmse"] for name in names}) if horizon else None


def error_line(turn: RoundResults) -> str:
    """One sentence with intervals; what it means at the noise floor."""
    found = joint_error(turn)
    if found is None:
        return "No held-out rollouts, so no error before and after."
    horizon, entries = found
    before, after, floor = (number(_entry(entries[name]), 2, 1e3) for name in ("before", "after", "floor"))
    meaning = noise_floor.meaning(entries["after"], entries["floor"])
    rollouts = plural(len(turn.diagnosis["holdout"]), "held-out rollout")
    return (
        f"Joint error after {horizon} s on {rollouts}: {before} mrad with the declared model, {after} mrad with the "
        f"corrected one; noise floor {floor} mrad" + (f" ({meaning})." if meaning else ".")
    )


def _entry(entry: Json) -> Json:
    value, low, high = value_and_interval(entry)
    return {"value": value, "ci95": (None, None) if low != low else (low, high)}
