"""The diagnosis as one self-contained page: pictures are SVG, all text that came from files is escaped."""

from collections.abc import Sequence
from html import escape
from typing import Any

from bumblebee.diagnosis.candidates import short_term
from bumblebee.diagnosis.report.headline import effect_groups, experiments, headline
from bumblebee.diagnosis.report.html import (
    NO_INLAY,
    Inlay,
    error_rows,
    figure,
    html_page,
    items,
    number,
    probability,
    share_of,
    table,
    warning,
)
from bumblebee.diagnosis.report.left_out import lost_without, shares_words
from bumblebee.diagnosis.report.left_table import what_is_left_table
from bumblebee.diagnosis.report.notes import early_first, unexplained_error, what_is_left, worse_horizons
from bumblebee.diagnosis.report.svg import NAMES, curve_picture, line_picture
from bumblebee.diagnosis.simulation import named, of_joint
from bumblebee.diagnosis.thresholds.report import Listing, ReportThresholds, Verdicts


def render_report(
    document: dict[str, Any],
    examples: Sequence[dict[str, Any]],
    rules: ReportThresholds | None = None,
    replays: Inlay = NO_INLAY,
) -> str:
    """HTML of the document and of windows to look at, with 3D replays of some under their curves."""
    held, rules = bool(document["holdout"]), rules or ReportThresholds()
    bad = worse_horizons(document["error"], rules.verdicts)
    parts = [
        "<h1>What the model lacks</h1>",
        *map(warning, early_first(document.get("notes", []))[0]),
        *_opening(document, rules),
        *[warning(text) for text in [*document.get("warnings", []), *bad]],
        *[warning(f"{a['rollout']} was set aside: {a['reason']}") for a in document.get("set_aside", [])],
        *_pictures(examples),
        replays.html,
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
    return html_page("Diagnosis", parts, replays)


def _opening(document: dict[str, Any], rules: ReportThresholds) -> list[str]:
    """First lines: what is gone, what is left, what to trust; where nothing was found, first that."""
    lines = headline(document, rules)
    if not document["effects"]:
        far = unexplained_error(document, rules.verdicts)
        nothing = "No effect of the catalogue is missing, as far as these data can tell."
        lines = [" ".join(far), *lines] if far else [nothing]
    kinds = ["lead first", *["lead"] * len(lines)]
    return [f"<p class='{kind}'>{escape(line)}</p>" for kind, line in zip(kinds, lines, strict=False)]


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
        text = f"{e['joint']}, simulated from the measured state at {e['start']:.2f} s of {e['rollout']}"
        parts.append(figure(picture, escape(text)))
    return parts


def _effects(document: dict[str, Any], rules: ReportThresholds) -> str:
    """The effects under what may be read from them."""
    groups = effect_groups(document, rules)
    if not groups:
        return "<p>None.</p>"
    titled, rows = bool(document.get("summary")), []
    for title, effects in groups:
        rows += [*([[escape(title)]] if titled else []), *(_effect(e, rules.listing) for e in effects)]
    head = ["effect", "lost without it", "value [95 % interval]", "declared", "p", "not distinguishable from"]
    text = f"<p class='note'>{escape(shares_words(document))} p: see diagnosis.json for the test.</p>"
    asked = experiments(document["effects"])
    told = f"<h3>To distinguish what is alike</h3>{items(asked)}" if asked else ""
    return table(head, rows, (4,)) + text + told


def _effect(e: dict[str, Any], rule: Listing) -> list[str]:
    place, share = escape(", ".join(e["where"]) or "whole robot"), lost_without(e)
    length = 4.0 * (e["explains"] or 0.0)
    bar = f"<span class='share'><span class='bar' style='width:{length:.2f}rem'></span>{share}</span>"
    values, declared = _values(e, rule)
    wide = "<br><span class='note'>size uncertain</span>" if e.get("wide") else ""
    name = f"<b>{escape(e['effect'])}</b><br><span class='place'>{place}</span>"
    return [
        name,
        bar,
        f"<span class='values'>{values}{wide}</span>",
        declared,
        probability(e["evidence"]["p"]),
        _same(e),
    ]


def _values(effect: dict[str, Any], rule: Listing) -> tuple[str, str]:
    """Values with intervals, and the declared ones."""
    parameters = effect["parameters"]
    if effect["effect"] == "discovered":
        terms = [
            f"{_with_ends(t['coefficient'], t['ci95'])} &middot; {_short(t['term'], rule.term)}"
            for t in parameters["terms"]
        ]
        return "<br>".join(terms), "-"
    lines = [
        f"{escape(name)} {_with_ends(p['value'], p['ci95'])} {escape(p['unit'])}" for name, p in parameters.items()
    ]
    return "<br>".join(lines), "<br>".join(number(p["nominal"]) for p in parameters.values())


def _short(term: str, most: int) -> str:
    more = "" if len(term) <= most else " <span class='note'>(see effects.yaml)</span>"
    return f"<code>{escape(short_term(term, most))}</code>{more}"


def _with_ends(value: float, ends: Sequence[float | None] | None) -> str:
    if not ends or all(x is None for x in ends):
        return f"{value:.4g}"
    low, high = ("" if x is None else f"{x:.4g}" for x in ends)
    return f"{value:.4g} <span class='note'>[{low}, {high}]</span>"


def _same(effect: dict[str, Any]) -> str:
    """Effects that look alike; with their place where it is another."""
    names = []
    for other in effect["equivalent"]:
        place = "" if other["where"] == effect["where"] else f" ({', '.join(other['where']) or 'whole'})"
        names.append(f"{other['effect']}{place}")
    return escape(", ".join(names)) or "-"


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
            share_of(e["torque_rms"], e["typical_torque"]),
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
    """Pictures of what is left over velocity, position and so on, a row a joint."""
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
    notes = [_parts(document), *early_first(document.get("notes", []))[1]]
    return notes + [f"{', '.join(u['where'])}: {u['why']}" for u in document.get("unidentifiable", [])]


def _parts(document: dict[str, Any]) -> str:
    """How many rollouts took which part; the held-out ones may be all that there is to validate on."""
    train, accept, holdout = (set(document.get(k, [])) for k in ("train", "accept", "holdout"))
    text = f"rollouts: {len(train - accept)} for identification, "
    if accept & holdout:
        return text + f"{len(holdout)} held out and used for validation"
    return text + f"{len(accept)} for validation, {len(holdout)} held out"
