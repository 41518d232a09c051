"""The plan as a few lines for a terminal."""

from typing import Any

from bumblebee.diagnosis.plan.predicted import pairs, words_of


def summary(told: dict[str, Any]) -> str:
    """Runs with what they reach, pairs that are told apart, intervals before and after."""
    lines = [
        f"{len(told['runs'])} runs of {told['seconds']:.4g} s at {told['rate']:g} Hz, "
        f"safe on {len(told['safe_on'])} robots:"
    ]
    for run in told["runs"]:
        shares = ", ".join(f"{k} {100 * run['reached'][k]['share']:.0f} %" for k in ("travel", "speed", "torque"))
        lines.append(f"  {run['run']}  {run['gains']}  {run['motion']}  ({shares})")
    asked = pairs(told["predicted"]["classes"])
    if asked:
        before, after = (sum(row["resolved"][when] for row in asked) for when in ("before", "after"))
        lines.append(f"pairs told apart: {before} of {len(asked)} now, {after} expected")
    for row in told["predicted"]["intervals"]:
        width = row["half_width"]
        if width["before"] is not None:
            value = f"{row['value']:.4g} ± {width['before']:.2g}"
            lines.append(f"  {words_of(row)} {row['parameter']}: {value} {row['unit']} -> ± {width['after']:.2g}")
        else:
            lines.append(f"  {words_of(row)} {row['parameter']}: interval expected {row['ratio']:.2f} times as wide")
    lines.append(
        f"usual effects of the joints: intervals {told['predicted']['usual']['median_ratio']:.2g} times as wide"
    )
    return "\n".join([*lines, *(f"note: {note}" for note in told["notes"])])
