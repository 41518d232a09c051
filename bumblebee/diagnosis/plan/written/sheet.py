"""The run sheet: a page to print for each run, with what to check, what is reached and what the run separates."""

from collections.abc import Sequence
from html import escape
from typing import Any

from bumblebee.diagnosis.plan.plan import Plan
from bumblebee.diagnosis.plan.predicted import pairs, words_of
from bumblebee.diagnosis.plan.written.document import run_names
from bumblebee.diagnosis.plan.written.drawing import panels
from bumblebee.diagnosis.report import number, table
from bumblebee.io.page_policy import policy_tag

_STYLE = """@page{size:A4;margin:13mm}:root{color-scheme:light}
body{font:13px/1.45 system-ui,-apple-system,'Segoe UI',sans-serif;color:#1d2430;background:#fff;margin:0 auto;
max-width:47rem;padding:1.2rem}h1{font-size:1.5rem;margin:0 0 .2rem}h2{font-size:1.2rem;margin:0}
h3{font-size:.95rem;margin:.9rem 0 .2rem}
p{margin:.3rem 0}.lead{font-size:1rem}.note{color:#6b7385;font-size:.85rem}
section{break-before:page;border-top:2px solid #1d2430;padding-top:.8rem;margin-top:2rem}
.head{display:flex;justify-content:space-between;align-items:baseline;gap:1rem}.tag{color:#6b7385}
.scroll{overflow-x:auto}table{border-collapse:collapse;margin:.3rem 0;font-size:.85rem;width:100%}
td,th{padding:.18rem .6rem .18rem 0;border-bottom:1px solid #e4e7ee;text-align:left;vertical-align:top}
th{color:#6b7385;font-weight:500}td.n,th.n{text-align:right;
font-variant-numeric:tabular-nums;padding-right:1.2rem}td.n{white-space:nowrap}
.panels{display:grid;grid-template-columns:1fr 1fr;gap:.2rem .9rem;margin:.4rem 0}.panels svg{
width:100%;height:auto;display:block}
ul.check{list-style:none;padding:0;margin:.3rem 0;columns:2;column-gap:1.4rem}
ul.check li{break-inside:avoid;padding:.12rem 0 .12rem 1.5rem;position:relative}
ul.check li::before{content:'';position:absolute;left:0;top:.28rem;width:.8rem;height:.8rem;border:1.2px solid #1d2430}
.write{border-bottom:1px solid #9aa3b5;display:inline-block;min-width:9rem}.good{color:#1b8a6b}.bad{color:#c8553d}
.warn{border-left:4px solid #c8553d;background:#fbeeea;padding:.4rem .8rem;margin:.5rem 0}
@media print{body{max-width:none;padding:0}section{border:0;padding:0;margin:0}a{color:inherit}}"""


def sheet(plan: Plan, told: dict[str, Any]) -> str:
    """The whole page; it loads nothing from anywhere."""
    view = "<meta name='viewport' content='width=device-width,initial-scale=1'>"
    title = f"Run sheet: {told['model']}"
    head = f"<meta charset='utf-8'>{policy_tag()}{view}<title>{escape(title)}</title><style>{_STYLE}</style>"
    pages = "".join(_page(plan, told, k) for k in range(len(plan.motions)))
    return f"<!doctype html><html lang='en'><head>{head}</head><body>\n{_front(plan, told)}\n{pages}</body></html>\n"


def _front(plan: Plan, told: dict[str, Any]) -> str:
    runs, seconds = len(told["runs"]), told["seconds"]
    command = told["command"]
    parts = [
        f"<h1>Run sheet: {escape(told['model'])}</h1>",
        f"<p class='lead'>{runs} runs of {seconds:.4g} s, position targets at {told['rate']:g} Hz, followed by "
        f"{escape(command['follow'])}.</p>",
        f"<p class='note'>seed {told['seed']}, sha256 {told['sha256'][:16]}</p>",
        "".join(f"<p class='warn'>{escape(_sentence(note))}</p>" for note in told["notes"][1:]),
        _safe_words(told),
        "<h3>Runs</h3>",
        _run_table(told),
        *_expected(plan, told),
        "<h3>Limits that every run keeps</h3>",
        _limit_table(told),
        f"<p class='note'>From: {escape('; '.join(f'{k}: {v}' for k, v in told['limits']['from'].items()))}. "
        "Margins are taken off already.</p>",
        f"<p class='note'>{escape(_sentence(told['notes'][0]))}</p>",
    ]
    return "\n".join(parts)


def _sentence(note: str) -> str:
    return f"{note[0].upper()}{note[1:]}."


def _safe_words(told: dict[str, Any]) -> str:
    names = told["safe_on"]
    shown = "; ".join(names[:8]) + (f"; and {len(names) - 8} more" if len(names) > 8 else "")
    stance = " The base stays upright and both feet down in each." if told["limits"]["stance"] else ""
    return (
        f"<p>Simulated on {len(names)} robots, within all limits on each: {escape(shown)}.{stance} "
        "A simulation is no promise: first run at reduced torque limits, with a hand on the stop.</p>"
    )


def _run_table(told: dict[str, Any]) -> str:
    rows = [
        [
            escape(run["run"]),
            escape(run["motion"]),
            escape(run["gains"]),
            *(f"{100 * run['reached'][k]['share']:.0f} %" for k in ("travel", "speed", "torque")),
        ]
        for run in told["runs"]
    ]
    return table(["run", "motion", "gains", "travel", "speed", "torque"], rows, (3, 4, 5))


def _expected(plan: Plan, told: dict[str, Any]) -> list[str]:
    """Expected outcome of the plan, in tables."""
    parts = []
    asked = pairs(told["predicted"]["classes"])
    if asked:
        parts += ["<h3>What it is expected to tell apart</h3>", _pair_table(asked, 8)]
    if told["predicted"]["intervals"]:
        rows = [
            [
                escape(words_of(row)),
                escape(f"{row['parameter']} [{row['unit']}]" if row["unit"] else row["parameter"]),
                number(row["value"]),
                _half(row["half_width"]["before"]),
                _half(row["half_width"]["after"]),
                f"{row['ratio']:.2f}",
            ]
            for row in told["predicted"]["intervals"][:10]
        ]
        head = ["effect", "parameter", "found", "now", "expected", "ratio"]
        parts += ["<h3>Intervals, half-width of 95 %</h3>", table(head, rows, (2, 3, 4, 5))]
    if not plan.basis.found:
        parts += ["<h3>What it is expected to see on each joint</h3>", _usual_table(plan, told)]
    return parts


def _pair_table(shown: Sequence[dict[str, Any]], most: int) -> str:
    """The first of `predicted.pairs`."""
    cells = [
        [
            escape(words_of(r["if"])),
            escape(words_of(r["not"])),
            _chi2(r["chi2"]["before"]),
            _chi2(r["chi2"]["after"]),
            number(r["cosine"]["after"], 4),
            "<span class='good'>yes</span>" if r["resolved"]["after"] else "<span class='bad'>no</span>",
        ]
        for r in shown[:most]
    ]
    open_ = sum(not r["resolved"]["after"] for r in shown)
    more = f"<p class='note'>The hardest first; of {len(shown)} pairs {open_} not expected to be told apart.</p>"
    return (
        table(["if it is", "and this is fitted", "chi² now", "expected", "cosine", "told apart"], cells, (2, 3, 4))
        + more
    )


def _chi2(value: float) -> str:
    return "&lt; 0.1" if value < 0.1 else number(value, 2)


def _usual_table(plan: Plan, told: dict[str, Any]) -> str:
    kinds = ("coulomb_friction", "viscous_friction", "armature", "motor_strength", "command_delay")
    joints = [name for name, moved in zip(told["joints"], plan.machine.moved, strict=True) if moved]
    found = {
        (row["effect"], row["where"][0] if row["where"] else ""): row for row in told["predicted"]["usual"]["effects"]
    }

    def cell(kind: str, joint: str) -> str:
        row = found.get((kind, joint))
        return "-" if row is None or not row["known"] else f"&plusmn;{_half(row['half_width']['after'])}"

    rows = [[escape(joint), *(cell(kind, joint) for kind in kinds)] for joint in joints[:24]]
    units = {k: next((r["unit"] for r in found.values() if r["effect"] == k), "") for k in kinds}
    head = ["joint", *(escape(k.replace("_", " ") + (f" [{units[k]}]" if units[k] else "")) for k in kinds)]
    note = (
        "<p class='note'>Half-widths of 95 % if all usual effects of the joint are fitted together; - : not by these "
        "runs.</p>"
    )
    return table(head, rows, range(1, 1 + len(kinds))) + note


def _half(value: float | None) -> str:
    return "no end" if value is None else number(value, 2)


def _limit_table(told: dict[str, Any]) -> str:
    rows = []
    for name, limit in told["limits"]["joints"].items():
        unit = told["units"][name]
        rows.append(
            [
                escape(name),
                number(told["start"][name]),
                f"{number(limit['low'])} to {number(limit['high'])} {unit['position']}",
                f"{number(limit['speed'])} {unit['velocity']}",
                f"{number(limit['torque'])} {unit['torque']}",
            ]
        )
    return table(["joint", "start", "travel", "speed", "torque"], rows, (1,))


def _page(plan: Plan, told: dict[str, Any], k: int) -> str:
    run = told["runs"][k]
    name = run_names(plan)[k]
    gain = f", {run['gains']}" if "kp" in run else ""
    parts = [
        f"<div class='head'><h2>Run {name}</h2><span class='tag'>runs/{name}.csv, {told['seconds']:.4g} s at "
        f"{told['rate']:g} Hz{gain}</span></div>",
        f"<p class='lead'>{escape(run['motion'][0].upper() + run['motion'][1:])}.</p>",
        f"<p>Start and end: {escape(_start_words(told))}.</p>",
        _gain_words(told, run),
        f"<div class='panels'>{''.join(panels(plan, k, told['units']))}</div>",
        "<h3>Reached in the worst of all rehearsals</h3>",
        _reached_table(run),
        *_purpose(run),
        "<h3>Check</h3>",
        _checks(told, run),
        "<p>Made at <span class='write'></span> by <span class='write'></span> log <span class='write'></span></p>",
    ]
    return f"<section>{''.join(parts)}</section>\n"


def _start_words(told: dict[str, Any]) -> str:
    """The start pose; of many joints those that are not at zero."""
    named = {name: value for name, value in told["start"].items() if len(told["start"]) <= 8 or abs(value) > 1e-6}
    words = [f"{name} {number(value)} {told['units'][name]['position']}" for name, value in named.items()]
    rest = ", all others at 0" if len(named) < len(told["start"]) else ""
    return ", ".join(words) + rest


def _gain_words(told: dict[str, Any], run: dict[str, Any]) -> str:
    """The gains to be set, where they are not the drives' own."""
    if "kp" not in run:
        return ""
    rows = zip(told["joints"], run["kp"], run["kd"], strict=True)
    values = "; ".join(f"{name} {number(kp)}, {number(kd)}" for name, kp, kd in rows if kp or kd)
    words = f"Gains of this run, {run['gains']} (joint kp, kd): {values}. Write kp and kd into the log's metadata."
    return f"<p class='warn'>{escape(words)}</p>"


def _reached_table(run: dict[str, Any]) -> str:
    rows = [
        [name, f"{100 * run['reached'][name]['share']:.0f} %", escape(run["reached"][name]["joint"])]
        for name in ("travel", "speed", "torque")
    ]
    return table(["limit", "share", "joint"], rows, (1,))


def _purpose(run: dict[str, Any]) -> list[str]:
    rows = [
        [f"{escape(words_of(s['if']))} from {escape(words_of(s['not']))}", f"{100 * s['share']:.0f} % of the chi²"]
        for s in run["separates"]
    ]
    rows += [
        [f"interval of {escape(words_of(n))}", f"{n['wider_without']:.2f} times wider without"] for n in run["narrows"]
    ]
    if not rows:
        return ["<h3>What it adds</h3><p>Widths of the usual effects; the other runs say the same of every pair.</p>"]
    return ["<h3>What it adds</h3>", table(["separates or narrows", "this run's part"], rows)]


def _checks(told: dict[str, Any], run: dict[str, Any]) -> str:
    items = [
        "nothing within reach but what the model has",
        "stop tried; a hand on it",
        "torque limits of the drives lowered for the first try",
        "robot rests in the start pose (front page)",
        "log: time, positions, velocities, targets" + (", commanded torques" if told["command"].get("kp") else ""),
        "all ticks logged, from before the start to after the end",
    ]
    if told["limits"]["stance"]:
        items.append("robot on its gantry, slack; feet flat, floor dry")
        items.append("log: base orientation, angular and linear velocity")
    if "kp" in run:
        items.append(f"gains set ({run['gains']}), and set back afterwards")
    return "<ul class='check'>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>"
