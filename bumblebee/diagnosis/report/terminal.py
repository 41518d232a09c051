"""Both reports as plain text for a terminal."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import short_term
from bumblebee.diagnosis.report.headline import effect_groups, experiments, headline
from bumblebee.diagnosis.report.html import share_of
from bumblebee.diagnosis.report.left_out import lost_without, shares_words
from bumblebee.diagnosis.report.notes import early_first, nothing_seen, what_is_left, worse_horizons
from bumblebee.diagnosis.simulation import motion_error, named, of_joint, pick, rows
from bumblebee.diagnosis.thresholds.report import Listing, ReportThresholds, Verdicts

_MARKS = {"target": ".", "before": "x", "after": "o", "measured": "#"}
_COLUMNS = {"before": "declared", "after": "corrected", "oracle": "true", "floor": "noise floor"}
"""Keys of the error block, as they are called for people."""


def summary(document: dict[str, Any], rules: ReportThresholds | None = None) -> str:
    """Warnings, a search that ended early first, effects with intervals, error before, after and floor."""
    rules = rules or ReportThresholds()
    early, notes = early_first(document.get("notes", []))
    lines = [f"WARNING: {text}" for text in [*early, *document.get("warnings", [])]]
    lines += [*headline(document, rules), "", *_grouped(document, rules)]
    columns = {k: document["error"][k] for k in _COLUMNS if k in document["error"]}
    where = "held-out rollouts" if document["holdout"] else "the fitted rollout"
    lines += ["", f"RMS prediction error on {where}:", *_errors(columns)]
    lines += [*worse_horizons(document["error"], rules.verdicts), ""]
    left = document["unexplained"]
    lines.append(f"unexplained: {what_is_left(document, rules.verdicts)} (p = {left['p']:.2g})")
    lines += [f"note: {note}" for note in notes]
    lines += [f"unidentifiable: {', '.join(u['where'])}: {u['why']}" for u in document.get("unidentifiable", [])]
    return "\n".join(lines)


def _grouped(document: dict[str, Any], rules: ReportThresholds) -> list[str]:
    """The effects under what may be read from them."""
    lines = []
    for title, effects in effect_groups(document, rules):
        lines.append(f"{title[:1].lower()}{title[1:]}:")
        lines += [line for e in effects for line in _effect(e, rules.listing)]
    lines += [shares_words(document)] if lines else []
    asked = experiments(document["effects"])
    if asked:
        lines += ["to distinguish what is alike:", *(f"  {text}" for text in asked)]
    return lines or ["no effect found"]


def _effect(effect: dict[str, Any], rule: Listing) -> list[str]:
    place, lines = ", ".join(effect["where"]) or "whole robot", []
    if effect["effect"] == "discovered":
        values = [(short_term(t["term"], rule.term), t | {"value": t["coefficient"], "unit": "", "nominal": None})
                  for t in effect["parameters"]["terms"]]  # fmt: skip
    else:
        values = list(effect["parameters"].items())
    for name, p in values:
        ends = ", ".join("" if x is None else f"{x:.4g}" for x in p["ci95"])
        between = f" [{ends}]" if ends != ", " else ""
        unit = f" {p['unit']}" if p["unit"] else ""
        declared = "" if p["nominal"] is None else f" (declared {p['nominal']:.4g})"
        lines.append(
            f"  {effect['effect']:<18} {place:<28} {name} = {p['value']:.4g}{between}{unit}{declared},"
            f" lost without it: {lost_without(effect)}{', size uncertain' if effect.get('wide') else ''}"
        )
    if effect["equivalent"]:
        some = effect["equivalent"][: rule.equivalent]
        same = ", ".join(f"{s['effect']} on {', '.join(s['where']) or 'all'}" for s in some)
        lines.append(f"  {'':<18} not distinguishable from: {same}")
    return lines


def _errors(columns: dict[str, dict[str, Any]]) -> list[str]:
    """Measures by horizon, a column for each error block."""
    lines = [f"  {'horizon':<8}{'':<34}" + "".join(f"{_COLUMNS.get(name, name):>12}" for name in columns)]
    for horizon, measures in next(iter(columns.values())).items():
        for label, unit, scale, key in rows(measures):
            cells = [pick(block.get(horizon, {}), key).get("value") for block in columns.values()]
            title = label + (f" [{unit}]" if unit else "")
            row = "".join(f"{'-':>12}" if v is None else f"{scale * v:>12.4g}" for v in cells)
            lines.append(f"  {horizon + ' s':<8}{title:<34}{row}")
    return lines


def plot(example: dict[str, Any], width: int = 76, height: int = 14) -> str:
    """A window as characters: # measured, x the declared model, o the corrected one, . target."""
    time = np.asarray(example["time"], dtype=float)
    series = {n: np.asarray(example[n], dtype=float) for n in _MARKS if n in example}
    known = np.concatenate([series[n] for n in ("measured", "target") if n in series])
    known = known[np.isfinite(known)]
    if len(time) < 2 or not len(known):
        return ""
    room = np.ptp(known) or 1e-3
    every = np.concatenate(list(series.values()))
    low = max(float(np.nanmin(every)), known.min() - room)
    high = min(float(np.nanmax(every)), known.max() + room)
    canvas = [[" "] * width for _ in range(height)]
    for x in range(width):
        at = time[0] + (time[-1] - time[0]) * x / (width - 1)
        for name, values in series.items():
            value = np.interp(at, time, values)
            if np.isfinite(value) and low <= value <= high:
                canvas[round((high - value) / max(high - low, 1e-12) * (height - 1))][x] = _MARKS[name]
    head = f"{example['joint']} [{example['unit']}] in {example['rollout']} from {example['start']:.2f} s"
    legend = "  ".join(
        f"{_MARKS[n]} {'model' if n == 'before' and 'after' not in series else _COLUMNS.get(n, n)}" for n in series
    )
    sides = [f"{high:>9.3g} |", *[f"{'':>9} |"] * (height - 2), f"{low:>9.3g} |"]
    body = [side + "".join(row) for side, row in zip(sides, canvas, strict=True)]
    return "\n".join([f"{head}   {legend}", *body, f"{'':>10} {time[0]:.2f} s{time[-1]:>{width - 8}.2f} s"])


def gap_summary(
    document: dict[str, Any], examples: Sequence[dict[str, Any]], rules: ReportThresholds | None = None
) -> str:
    """The gap report: a picture, errors by horizon and joint, the torque that is missing, motions, notes."""
    rules = rules or ReportThresholds()
    error = document["error"]
    lines = [plot(examples[0]) if examples else "", ""]
    lines += [f"WARNING: {text}" for text in document.get("warnings", [])]
    lines += [
        "RMS prediction error of windows that start from measured states:",
        *_errors({"model": error, "floor": document["floor"]}),
    ]
    lines += _joints(document)
    lines += ["", "residual torque, which the model lacks:", *missing_lines(document, rules.verdicts)]
    lines += _reported(document)
    lines += ["", "worst motions:"]
    for m in document["motions"][: rules.listing.motions]:
        lines.append(f"  {m['motion']:<40} {motion_error(m)} after {m['horizon']} s")
    lines += [f"note: {note}" for note in document["notes"]]
    lines += [f"unidentifiable: {', '.join(u['where'])}: {u['why']}" for u in document["unidentifiable"]]
    return "\n".join(lines)


def _joints(document: dict[str, Any]) -> list[str]:
    """Position errors of every joint, a column a horizon."""
    error = document["error"]
    if not error:
        return []
    lines = ["", f"  {'joint position, joint by joint':<34}" + "".join(f"{h + ' s':>12}" for h in error)]
    for joint in next(iter(error.values()))["joint_pos_rmse"]["per_joint"]:
        values = [m["joint_pos_rmse"]["per_joint"][joint]["value"] for m in error.values()]
        row = "".join(f"{'-':>12}" if v is None else f"{1e3 * v:>12.4g}" for v in values)
        lines.append(f"  {named(document, joint):<34}{row}")
    return lines


def _reported(document: dict[str, Any]) -> list[str]:
    if not document["reported_torque"]:
        return []
    lines = ["", "reported drive torque against that of the declared drives:"]
    for j, e in document["reported_torque"].items():
        bias = f"{e['bias']:.3g} {of_joint(document, j, 'torque')}"
        late, alike = f"delay {1e3 * e['delay']:.1f} ms", f"correlation {e['correlation']:.3f}"
        lines.append(f"  {j:<28} gain {e['gain']:.3f}, bias {bias}, {late}, {alike}")
    return lines


def missing_lines(document: dict[str, Any], rule: Verdicts) -> list[str]:
    """Missing torque of every joint, a line each."""
    lacking = document["missing_torque"]
    if not lacking:
        return ["  too few windows to say"]
    lines = []
    for joint, e in lacking.items():
        if e["significant"]:
            share = share_of(e["structured_rms"], e["drive_rms"], "its drive torque")
            on = ", ".join(e["depends_on"]) or "no single quantity"
            size = f"{e['structured_rms']:.3g} {e['unit']} RMS ({share})"
            lines.append(f"  {joint:<28} {size}, depends on {on}")
        else:
            lines.append(f"  {joint:<28} {nothing_seen(document, joint, rule)} (p = {e['p']:.2g})")
    return lines
