"""The diagnosis as one self-contained page: pictures are SVG, all text that came from files is escaped."""

from html import escape
from typing import Any

_STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1d2430}
table{border-collapse:collapse;margin:.5rem 0;width:100%}
td,th{padding:.25rem .6rem;border-bottom:1px solid #dde;text-align:left}
td.n{text-align:right;font-variant-numeric:tabular-nums}.lead{font-size:1.15rem}.note{color:#667}svg{width:100%;height:auto}"""
_COLOURS = {"measured": "#1d2430", "before": "#d1495b", "after": "#2a9d8f"}


def render_report(document: dict[str, Any], example: dict[str, Any]) -> str:
    """HTML of the document and the example window."""
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'><title>Diagnosis</title>",
        f"<style>{_STYLE}</style></head><body><h1>What the model lacks</h1>",
        f"<p class='lead'>{_lead(document)}</p>",
        _picture(example),
        "<h2>Effects</h2>",
        _effects_table(document["effects"]),
        "<h2>Error on rollouts that took no part in the fit</h2>" if document["holdout"] else "<h2>Error</h2>",
        _error_table(document["error"]),
        "<h2>Joint by joint</h2>",
        _joint_table(document["error"]),
        "<h2>What is left</h2>",
        _left(document),
        "</body></html>",
    ]
    return "\n".join(parts)


def _lead(document: dict[str, Any]) -> str:
    effects = document["effects"]
    if not effects:
        return "No effect of the catalogue is missing, as far as these data can tell."
    names = [f"<b>{escape(e['effect'])}</b> on {escape(', '.join(e['where']))}" for e in effects]
    return f"{len(effects)} found: " + "; ".join(names) + "."


def _picture(example: dict[str, Any]) -> str:
    """Measured against the model before and after, as SVG."""
    series = {name: example[name] for name in ("before", "after", "measured")}
    finite = [v for values in series.values() for v in values if v == v and abs(v) < 1e6]
    if not finite or len(example["time"]) < 2:
        return ""
    low, high = min(finite), max(finite)
    high = high if high > low else low + 1e-3
    left, top, width, height = 70, 20, 760, 260
    t0, t1 = example["time"][0], example["time"][-1]

    def at(t: float, v: float) -> str:
        return f"{left + (t - t0) / (t1 - t0) * width:.1f},{top + (high - v) / (high - low) * height:.1f}"

    lines = []
    for row, (name, values) in enumerate(series.items()):
        points = " ".join(at(t, v) for t, v in zip(example["time"], values, strict=True) if v == v and abs(v) < 1e6)
        lines.append(f"<polyline fill='none' stroke='{_COLOURS[name]}' stroke-width='2' points='{points}'/>")
        lines.append(f"<text x='{left + 8 + 110 * row}' y='{top + 12}' fill='{_COLOURS[name]}'>{name}</text>")
    axis = (
        f"<rect x='{left}' y='{top}' width='{width}' height='{height}' fill='none' stroke='#bbc'/>"
        f"<text x='4' y='{top + 10}'>{high:.4g}</text><text x='4' y='{top + height}'>{low:.4g}</text>"
        f"<text x='{left}' y='{top + height + 18}'>{t0:.2f} s</text>"
        f"<text x='{left + width - 40}' y='{top + height + 18}'>{t1:.2f} s</text>"
    )
    title = f"{example['joint']} [rad], restarted in {example['rollout']} at {example['start']:.2f} s"
    return f"<h2>{escape(title)}</h2><svg viewBox='0 0 850 310' font-size='12'>{axis}{''.join(lines)}</svg>"


def _effects_table(effects: list[dict[str, Any]]) -> str:
    rows = []
    for e in effects:
        for name, p in e["parameters"].items():
            same = ", ".join(f"{s['effect']} ({', '.join(s['where'])})" for s in e["equivalent"]) or "-"
            cells = [
                escape(e["effect"]),
                escape(", ".join(e["where"])),
                escape(f"{name} = {p['value']:.4g} {p['unit']}"),
                escape(f"{p['ci95'][0]:.4g} to {p['ci95'][1]:.4g}"),
                f"{p['nominal']:.4g}",
                f"{100 * e['explains']:.1f} %",
                f"{e['evidence']['p']:.1g}",
                escape(same),
            ]
            rows.append("<tr>" + "".join(f"<td>{c}</td>" for c in cells) + "</tr>")
    head = ("effect", "where", "value", "95 % interval", "declared", "explains", "p", "cannot be told from")
    return _table(head, rows) if rows else "<p>None.</p>"


def _table(head: tuple[str, ...], rows: list[str]) -> str:
    return "<table><tr>" + "".join(f"<th>{h}</th>" for h in head) + "</tr>" + "".join(rows) + "</table>"


def _error_table(error: dict[str, Any]) -> str:
    rows = []
    for horizon, measures in error["before"].items():
        for name in measures:
            if name == "windows":
                continue
            cells = [f"<td>{escape(horizon)} s</td><td>{escape(name)}</td>"]
            for part in ("before", "after", "floor"):
                cells.append(f"<td class='n'>{_value(error[part].get(horizon, {}).get(name))}</td>")
            rows.append("<tr>" + "".join(cells) + "</tr>")
    return _table(("horizon", "measure", "before", "after", "noise floor"), rows)


def _joint_table(error: dict[str, Any]) -> str:
    horizon = "0.2" if "0.2" in error["before"] else next(iter(error["before"]), None)
    if horizon is None:
        return ""
    rows = []
    for joint, before in error["before"][horizon]["joint_pos_rmse"]["per_joint"].items():
        after = error["after"][horizon]["joint_pos_rmse"]["per_joint"][joint]
        cells = f"<td>{escape(joint)}</td><td class='n'>{_value(before)}</td><td class='n'>{_value(after)}</td>"
        rows.append(f"<tr>{cells}</tr>")
    return f"<p class='note'>position error after {horizon} s [rad]</p>" + _table(("joint", "before", "after"), rows)


def _value(entry: dict[str, Any] | None) -> str:
    if not entry or entry["value"] is None:
        return "-"
    ci = entry.get("ci95")
    return f"{entry['value']:.4g}" + (f" <span class='note'>({ci[0]:.3g} to {ci[1]:.3g})</span>" if ci else "")


def _left(document: dict[str, Any]) -> str:
    left = document["unexplained"]
    text = escape(left["description"]) if left["significant"] else "No structure is left that these tests can see."
    notes = [f"<li>{escape(note)}</li>" for note in document.get("notes", [])]
    for entry in document.get("unidentifiable", []):
        notes.append(f"<li>{escape(', '.join(entry['where']))}: {escape(entry['why'])}</li>")
    return f"<p>{text} (p = {left['p']:.2g})</p>" + (f"<ul>{''.join(notes)}</ul>" if notes else "")
