"""The diagnosis as one self-contained page: pictures are SVG, all text that came from files is escaped."""

from collections.abc import Sequence
from html import escape
from typing import Any

from bumblebee.diagnosis.report.headline import effect_groups, headline
from bumblebee.diagnosis.report.html import error_rows, figure, html_page, items, number, probability, table, warning
from bumblebee.diagnosis.report.left_table import what_is_left_table
from bumblebee.diagnosis.report.notes import beside_noise, told_horizon, unexplained_error, what_is_left, worse_horizons
from bumblebee.diagnosis.report.svg import NAMES, curve_picture, line_picture
from bumblebee.diagnosis.simulation import named, of_joint, pick, position_rows
from bumblebee.diagnosis.thresholds.report import ReportThresholds, Verdicts


def render_report(
    document: dict[str, Any], examples: Sequence[dict[str, Any]], rules: ReportThresholds | None = None
) -> str:
    """HTML of the document and of windows to look at."""
    held, rules = bool(document["holdout"]), rules or ReportThresholds()
    bad = worse_horizons(document["error"], rules.verdicts)
    parts = [
        "<h1>What the model lacks</h1>",
        *_opening(document, rules),
        *[warning(text) for text in [*document.get("warnings", []), *bad]],
        *[warning(f"{a['rollout']} was set aside: {a['reason']}") for a in document.get("set_aside", [])],
        *_pictures(examples),
        what_is_left_table(document),
        "<h2>Effects</h2>",
        _effects(document, rules),
        f"<h2>Prediction error on {'held-out rollouts' if held else 'the fitted rollout'}</h2>",
        error_rows({name: document["error"][k] for k, name in NAMES.items() if k in document["error"]}),
        "<h2>Error by joint</h2>",
        _joints(document, rules.verdicts),
        "<h2>Unexplained residual</h2>",
        _left(document, rules),
        _small(document.get("smallest_detectable", []), rules.listing.detectable),
        "<h2>Notes</h2>",
        items(_notes(document)),
    ]
    return html_page("Diagnosis", parts)


def _opening(document: dict[str, Any], rules: ReportThresholds) -> list[str]:
    """What is gone, what is left, what to trust; of a document without that block, the effects and the error."""
    told = headline(document, rules.matters)
    if not document["effects"] or not told:
        far = unexplained_error(document, rules.verdicts)
        return [f"<p class='lead'>{_lead(document, rules)}</p>", *(f"<p>{escape(line)}</p>" for line in told if far)]
    return [
        f"<p class='lead'><b>{escape(told[0])}</b></p>",
        *(f"<p class='lead'>{escape(line)}</p>" for line in told[1:]),
    ]


def _lead(document: dict[str, Any], rules: ReportThresholds) -> str:
    most, effects, error = rules.listing.effects, document["effects"], document["error"]
    if effects:
        names = [
            f"<b>{escape(e['effect'])}</b> on {escape(', '.join(e['where']) or 'the whole robot')}" for e in effects
        ]
        more = f" and {len(names) - most} more" if len(names) > most else ""
        text = f"{len(effects)} effect{'s' if len(effects) > 1 else ''}: {'; '.join(names[:most])}{more}."
    elif far := unexplained_error(document, rules.verdicts):
        return escape(" ".join(far))
    else:
        return "No effect of the catalogue is missing, as far as these data can tell."
    horizon = told_horizon(error["before"])
    if horizon is None:
        return text
    where = "held-out RMS error" if document["holdout"] else "RMS error on the fitted rollout"
    said = []
    for what, unit, scale, key in position_rows(error["before"][horizon]):
        before, after, floor = (pick(error[k].get(horizon, {}), key) for k in ("before", "after", "floor"))
        if before.get("value") and after.get("value"):
            noise = beside_noise(after, floor, unit, scale)
            goes = "falls" if after["value"] < before["value"] else "goes"
            said.append(
                f" After {horizon} s the {where} of the {what} {goes} from {number(scale * before['value'])} to "
                f"{number(scale * after['value'])} {unit}{f' ({noise})' if noise else ''}."
            )
    return text + "".join(said)


def _pictures(examples: Sequence[dict[str, Any]]) -> list[str]:
    parts = []
    for n, e in enumerate(examples):
        series: dict[str, Any] = {name: e[name] for name in ("target", "before", "after", "measured") if name in e}
        axis = f"{e['joint']} [{e['unit']}]"
        picture = line_picture(
            e["time"],
            series,
            "time since the measured initial state [s]",
            axis,
            f"{e['joint']}: measured, declared model, corrected model",
            240 if n == 0 else 130,
        )
        text = f"{e['joint']}, simulated from the measured state in {e['rollout']} at {e['start']:.2f} s"
        parts.append(figure(picture, escape(text)))
    return parts


def _effects(document: dict[str, Any], rules: ReportThresholds) -> str:
    """The effects under what may be read from them."""
    groups = effect_groups(document, rules.matters)
    if not groups:
        return "<p>None.</p>"
    titled = bool(document.get("summary"))
    parts = [(f"<h3>{escape(title)}</h3>" if titled else "") + _listed(effects) for title, effects in groups]
    text = (
        "<p class='note'>explains: share of the excess chi-square over the best fit that returns when this effect "
        "alone is removed. p: see diagnosis.json for the test.</p>"
    )
    return "".join(parts) + text


def _listed(effects: Sequence[dict[str, Any]]) -> str:
    rows = []
    for e in effects:
        place = escape(", ".join(e["where"]) or "whole robot")
        share = 100 * e["explains"]
        bar = f"<span class='share'><span class='bar' style='width:{0.04 * share:.2f}rem'></span>{share:.0f} %</span>"
        values, declared = _values(e)
        rows.append(
            [
                f"<b>{escape(e['effect'])}</b>",
                place,
                f"<span class='values'>{values}</span>",
                declared,
                bar,
                probability(e["evidence"]["p"]),
                _same(e),
            ]
        )
    head = ["effect", "where", "value [95 % interval]", "declared", "explains", "p", "not distinguishable from"]
    return table(head, rows, (5,))


def _values(effect: dict[str, Any]) -> tuple[str, str]:
    """Values with intervals, and the declared ones."""
    parameters = effect["parameters"]
    if effect["effect"] == "discovered":
        terms = [
            f"{_with_ends(t['coefficient'], t['ci95'])} &middot; <code>{escape(_short(t['term']))}</code>"
            for t in parameters["terms"]
        ]
        return "<br>".join(terms), "-"
    lines = [
        f"{escape(name)} {_with_ends(p['value'], p['ci95'])} {escape(p['unit'])}" for name, p in parameters.items()
    ]
    return "<br>".join(lines), "<br>".join(number(p["nominal"]) for p in parameters.values())


def _short(term: str) -> str:
    return term if len(term) <= 60 else f"{term[:40]} ... (see effects.yaml)"


def _with_ends(value: float, ends: Sequence[float | None] | None) -> str:
    if not ends:
        return f"{value:.4g}"
    low, high = ("" if x is None else f"{x:.4g}" for x in ends)
    return f"{value:.4g} <span class='note'>[{low}, {high}]</span>"


def _same(effect: dict[str, Any]) -> str:
    same = [f"{s['effect']} ({', '.join(s['where']) or 'whole'})" for s in effect["equivalent"]]
    text = escape(", ".join(same)) or "-"
    advice = "; ".join(effect.get("separate_by", []))
    return text + (f"<br><span class='note'>to distinguish them: {escape(advice)}</span>" if advice else "")


def _joints(document: dict[str, Any], rule: Verdicts) -> str:
    """Before and after by joint and horizon, coloured where they differ."""
    error = document["error"]
    if not error["before"]:
        return ""
    rows = []
    for joint in next(iter(error["before"].values()))["joint_pos_rmse"]["per_joint"]:
        cells = [escape(named(document, joint))]
        for horizon in error["before"]:
            pair = [error[k][horizon]["joint_pos_rmse"]["per_joint"][joint]["value"] for k in ("before", "after")]
            if None in pair:
                cells.append("-")
                continue
            better, worse = pair[1] < rule.better * pair[0], pair[1] > rule.joint_worse * pair[0]
            kind = "good" if better else "bad" if worse else "note"
            cells.append(f"{number(1e3 * pair[0])} <span class='{kind}'>&rarr; {number(1e3 * pair[1])}</span>")
        rows.append(cells)
    text = "<p class='note'>RMS position error, declared &rarr; corrected model, in mrad or mm as beside the joint.</p>"
    return text + table(["joint", *[f"{h} s" for h in error["before"]]], rows, range(1, 1 + len(error["before"])))


def _left(document: dict[str, Any], rules: ReportThresholds) -> str:
    left, structure = document["unexplained"], document.get("structure", {})
    if not left["significant"]:
        said = what_is_left(document, rules.verdicts)
        return f"<p>{escape(said[:1].upper() + said[1:])} (p = {left['p']:.2g}).</p>"
    rows = [
        [
            escape(joint),
            f"{e['torque_rms']:.3g} {of_joint(document, joint, 'torque')}",
            f"{100 * e['torque_rms'] / e['typical_torque']:.0f} %",
            escape(", ".join(e["depends_on"])) or "-",
            probability(e["p"]),
        ]
        for joint, e in structure.items()
        if joint in left["where"]
    ]
    text = (
        "<p>The residual has structure that no effect above explains (lack of fit). It is described, not attributed to "
        "an effect of the catalogue.</p>"
    )
    head = ["joint", "RMS", "share of drive torque", "depends on", "p"]
    said = f"<p>{escape(left['description'])}.</p>"
    listed = table(head, rows, (1, 2, 4)) if rows else ""
    return text + listed + said + "".join(_curves(document, left["where"][: rules.unexplained.joints]))


def _curves(document: dict[str, Any], joints: Sequence[str]) -> list[str]:
    """What is left over velocity, position and so on, a row of pictures a joint."""
    parts = []
    for joint in joints:
        known = document.get("structure", {}).get(joint, {}).get("curves", {})
        lacks = f"residual [{of_joint(document, joint, 'torque')}]"
        drawn = [
            figure(curve_picture(rows, quantity, lacks, f"{joint} over {quantity}"), escape(joint))
            for quantity, rows in known.items()
        ]
        parts.append(f"<div class='row'>{''.join(drawn)}</div>")
    return parts


def _small(entries: Sequence[dict[str, Any]], most: int) -> str:
    known = [e for e in entries if e.get("change") is not None]
    if not known:
        return ""
    rows = [
        [
            escape(e["effect"]),
            escape(", ".join(e["where"]) or "whole robot"),
            escape(e.get("parameter", "")),
            f"{e['change']:.2g} {escape(e.get('unit', ''))}",
        ]
        for e in known[:most]
    ]
    more = f"<p class='note'>and {len(known) - most} more in diagnosis.json</p>" if len(known) > most else ""
    body = table(["effect", "where", "parameter", "change"], rows, (3,))
    return f"<details><summary>Smallest detectable changes with these data</summary>{body}{more}</details>"


def _notes(document: dict[str, Any]) -> list[str]:
    notes = [_parts(document), *document.get("notes", [])]
    return notes + [f"{', '.join(u['where'])}: {u['why']}" for u in document.get("unidentifiable", [])]


def _parts(document: dict[str, Any]) -> str:
    """How many rollouts took which part; the held-out ones may be all that there is to validate on."""
    train, accept, holdout = (set(document.get(k, [])) for k in ("train", "accept", "holdout"))
    text = f"rollouts: {len(train - accept)} for identification, "
    if accept & holdout:
        return text + f"{len(holdout)} held out and used for validation"
    return text + f"{len(accept)} for validation, {len(holdout)} held out"
