"""The gap report as one self-contained page."""

from html import escape
from typing import Any

from bumblebee.diagnosis.drawing import cloud_picture, line_picture
from bumblebee.diagnosis.gap import Gap
from bumblebee.diagnosis.page import UNITS, figure, interval, items, number, page, probability, shade, table, warning

_MOTIONS = 15


def gap_page(report: Gap) -> str:
    """HTML of the gap report."""
    document = report.document
    parts = [
        "<h1>Where the model errs</h1>",
        f"<p class='lead'>{_lead(document)}</p>",
        *[warning(f"{entry['rollout']} was set aside: {entry['reason']}") for entry in document["set_aside"]],
        *_pictures(report),
        "<h2>Error of windows restarted from measured states</h2>",
        error_rows({"model": document["error"], "noise floor": document["floor"]}),
        "<h2>Joint by joint</h2>",
        _joints(document),
        "<h2>The torque that the model lacks</h2>",
        _torque(document["missing_torque"]),
        *_clouds(report),
        *_reported(document["reported_torque"]),
        "<h2>Motion by motion</h2>",
        _motions(document["motions"]),
        "<h2>Notes</h2>" if document["notes"] or document["unidentifiable"] else "",
        items(document["notes"] + [f"{', '.join(u['where'])}: {u['why']}" for u in document["unidentifiable"]]),
    ]
    return page("Gap report", parts)


def _lead(document: dict[str, Any]) -> str:
    count, seconds = len(document["rollouts"]), document["seconds"]
    horizon = "0.2" if "0.2" in document["error"] else next(iter(document["error"]), None)
    text = f"{count} rollout{'s' if count != 1 else ''}, {seconds:.0f} s, {document['commands']}. Nothing was fitted."
    if horizon is None:
        return escape(text)
    error = document["error"][horizon]["joint_pos_rmse"]
    floor = document["floor"][horizon]["joint_pos_rmse"]
    if error["value"] is None or not floor["value"]:
        return escape(text)
    worst = max(error["per_joint"].items(), key=lambda item: item[1]["value"] or 0.0)
    return escape(
        f"{text} After {horizon} s the joints are {1e3 * error['value']:.3g} mrad off, "
        f"{error['value'] / floor['value']:.2g} times what sensor noise leaves; most on {worst[0]}."
    )


def _pictures(report: Gap) -> list[str]:
    return [
        figure(
            line_picture(
                e["time"],
                {k: e[s] for k, s in (("target", "target"), ("model", "before"), ("measured", "measured")) if s in e},
                "s after the restart",
                f"{e['joint']} [{e['unit']}]",
                f"{e['joint']}: measured and model",
                height=220 if n == 0 else 130,
            ),
            escape(f"{e['joint']}, restarted from the measured state in {e['rollout']} at {e['start']:.2f} s"),
        )
        for n, e in enumerate(report.examples)
    ]


def error_rows(columns: dict[str, dict[str, Any]]) -> str:
    """Rows for horizon and measure, a column for each error block."""
    rows = []
    first = next(iter(columns.values()))
    for horizon, measures in first.items():
        for name in measures:
            if name not in UNITS:
                continue
            label, unit, scale = UNITS[name]
            cells = [interval(block.get(horizon, {}).get(name), scale) for block in columns.values()]
            rows.append([f"{escape(horizon)} s", label + (f" [{unit}]" if unit else ""), *cells])
        lost = measures.get("windows", {}).get("diverged", 0)
        if lost:
            rows.append([f"{escape(horizon)} s", "windows that diverged", str(lost), *[""] * (len(columns) - 1)])
    return table(["after", "", *columns], rows, range(2, 2 + len(columns)))


def _joints(document: dict[str, Any]) -> str:
    error, floor = document["error"], document["floor"]
    if not error:
        return ""
    joints = list(next(iter(error.values()))["joint_pos_rmse"]["per_joint"])
    rows = []
    for joint in joints:
        cells = [escape(joint)]
        for horizon, measures in error.items():
            mine = measures["joint_pos_rmse"]["per_joint"][joint]["value"]
            noise = floor.get(horizon, {}).get("joint_pos_rmse", {}).get("per_joint", {}).get(joint, {}).get("value")
            ratio = mine / noise if mine is not None and noise else 1.0
            text = number(None if mine is None else 1e3 * mine)
            cells.append(f"<span style='padding:0 .4rem;{shade(ratio)}'>{text}</span>")
        rows.append(cells)
    text = "<p class='note'>RMS position error in mrad (mm for slides); the redder, the further above the noise.</p>"
    return text + table(["joint", *[f"{h} s" for h in error]], rows, range(1, 1 + len(error)))


def _torque(lacking: dict[str, Any]) -> str:
    if not lacking:
        return "<p>Too few windows to say.</p>"
    rows = []
    for joint, entry in lacking.items():
        on = escape(", ".join(entry["depends_on"])) or "no single quantity"
        share = f"{100 * entry['structured_rms'] / entry['drive_rms']:.0f} %" if entry["drive_rms"] else "-"
        rows.append(
            [
                escape(joint),
                number(entry["mean"]),
                number(entry["structured_rms"]) if entry["significant"] else "-",
                share if entry["significant"] else "-",
                on if entry["significant"] else "<span class='note'>nothing that these tests can see</span>",
                probability(entry["p"]),
            ]
        )
    head = ["joint", "mean [N m]", "predictable RMS [N m]", "of the drive's", "goes with", "p"]
    text = (
        "<p class='note'>Torque that would make up for the missed velocities, over 0.04 s or a tick. The predictable "
        "part is what boosted trees, trained on some rollouts, foresee on others; p is corrected for the number of "
        "joints.</p>"
    )
    return text + table(head, rows, (1, 2, 3, 5))


def _clouds(report: Gap) -> list[str]:
    """Missing torque over velocity and position of the joints with most structure."""
    data = report.torque
    if data is None:
        return []
    worst = [j for j, e in report.document["missing_torque"].items() if e["significant"]][:3]
    parts = []
    for joint in worst:
        j = data.joints.index(joint)
        pair = [
            cloud_picture(
                data.v[:, j], data.missing[:, j], "velocity [rad/s]", "missing [N m]", f"{joint} over velocity"
            ),
            cloud_picture(
                data.q[:, j], data.missing[:, j], "position [rad]", "missing [N m]", f"{joint} over position"
            ),
        ]
        shown = "".join(figure(p, escape(f"{joint}: mean in equally filled bins, 95 % interval")) for p in pair)
        parts.append(f"<div class='row'>{shown}</div>")
    return parts


def _reported(table_: dict[str, dict[str, float]]) -> list[str]:
    if not table_:
        return []
    rows = [
        [escape(j), number(e["gain"]), number(e["bias"]), f"{1e3 * e['delay']:.1f}", number(e["correlation"])]
        for j, e in table_.items()
    ]
    text = (
        "<p class='note'>The drive's reported torque against what the declared drive would give at the measured state. "
        "A gain or delay here is the drive's; what is wrong beyond it is friction, inertia or load.</p>"
    )
    head = ["joint", "gain", "bias [N m]", "delay [ms]", "correlation"]
    return ["<h2>The drives' own torque</h2>", text, table(head, rows, (1, 2, 3, 4))]


def _motions(motions: list[dict[str, Any]]) -> str:
    rows = [
        [
            escape(m["cluster"]) or "-",
            escape(m["motion"]),
            str(m["windows"]),
            number(None if m["joint_pos_rmse"] is None else 1e3 * m["joint_pos_rmse"]),
        ]
        for m in motions[:_MOTIONS]
    ]
    more = f"<p class='note'>and {len(motions) - _MOTIONS} more</p>" if len(motions) > _MOTIONS else ""
    horizon = motions[0]["horizon"] if motions else "0.2"
    return table(["cluster", "motion", "windows", f"joints after {horizon} s [mrad]"], rows, (2, 3)) + more
