"""The gap report as one self-contained page."""

from html import escape
from typing import Any

from bumblebee.diagnosis.gap.gap import Gap
from bumblebee.diagnosis.report import (
    cloud_picture,
    error_rows,
    figure,
    html_page,
    items,
    line_picture,
    nothing_seen,
    number,
    probability,
    shade,
    share_of,
    table,
    warning,
)
from bumblebee.diagnosis.simulation import motion_error, named, of_joint, pick, position_rows


def gap_page(report: Gap) -> str:
    """HTML of the gap report."""
    document = report.document
    parts = [
        "<h1>Where the declared model errs</h1>",
        f"<p class='lead'>{_lead(document)}</p>",
        *[warning(text) for text in document.get("warnings", [])],
        *[warning(f"{entry['rollout']} was set aside: {entry['reason']}") for entry in document["set_aside"]],
        *_pictures(report),
        "<h2>Prediction error of windows that start from measured states</h2>",
        error_rows({"declared model": document["error"], "noise floor": document["floor"]}),
        "<h2>Error by joint</h2>",
        _joints(document),
        "<h2>Residual torque, which the model lacks</h2>",
        _torque(report),
        *_clouds(report),
        *_reported(document),
        "<h2>Error by motion</h2>",
        _motions(document["motions"], report.thresholds.gap.page.motions),
        "<h2>Notes</h2>" if document["notes"] or document["unidentifiable"] else "",
        items(document["notes"] + [f"{', '.join(u['where'])}: {u['why']}" for u in document["unidentifiable"]]),
    ]
    return html_page("Gap report", parts)


def _lead(document: dict[str, Any]) -> str:
    count, seconds = len(document["rollouts"]), document["seconds"]
    horizon = "0.2" if "0.2" in document["error"] else next(iter(document["error"]), None)
    text = f"{count} rollout{'s' if count != 1 else ''}, {seconds:.0f} s, {document['commands']}. Nothing was fitted."
    if horizon is None:
        return escape(text)
    error, floor = document["error"][horizon], document["floor"][horizon]
    said = []
    for what, unit, scale, key in position_rows(error):
        value, noise = pick(error, key).get("value"), pick(floor, key).get("value")
        if value is not None and noise:
            said.append(
                f"the RMS error of the {what} is {number(scale * value)} {unit}, {number(value / noise, 2)} times the "
                "noise floor"
            )
    if not said:
        return escape(text)
    return escape(f"{text} After {horizon} s {'; '.join(said)}; largest on {_worst(error, floor)}.")


def _worst(error: dict[str, Any], floor: dict[str, Any]) -> str:
    """The joint furthest off; beside its noise where hinges and slides cannot be compared otherwise."""
    mixed = "by_kind" in error["joint_pos_rmse"]
    noise = floor["joint_pos_rmse"]["per_joint"]

    def size(joint: str) -> float:
        value = error["joint_pos_rmse"]["per_joint"][joint]["value"] or 0.0
        return value / (noise[joint]["value"] or 1.0) if mixed else value

    return max(error["joint_pos_rmse"]["per_joint"], key=size)


def _pictures(report: Gap) -> list[str]:
    return [
        figure(
            line_picture(
                e["time"],
                {k: e[s] for k, s in (("target", "target"), ("model", "before"), ("measured", "measured")) if s in e},
                "time since the measured initial state [s]",
                f"{e['joint']} [{e['unit']}]",
                f"{e['joint']}: measured and model",
                height=220 if n == 0 else 130,
            ),
            escape(f"{e['joint']}, simulated from the measured state at {e['start']:.2f} s of {e['rollout']}"),
        )
        for n, e in enumerate(report.examples)
    ]


def _joints(document: dict[str, Any]) -> str:
    error, floor = document["error"], document["floor"]
    if not error:
        return ""
    joints = list(next(iter(error.values()))["joint_pos_rmse"]["per_joint"])
    rows = []
    for joint in joints:
        cells = [escape(named(document, joint))]
        for horizon, measures in error.items():
            mine = measures["joint_pos_rmse"]["per_joint"][joint]["value"]
            noise = floor.get(horizon, {}).get("joint_pos_rmse", {}).get("per_joint", {}).get(joint, {}).get("value")
            ratio = mine / noise if mine is not None and noise else 1.0
            text = number(None if mine is None else 1e3 * mine)
            cells.append(f"<span style='padding:0 .4rem;{shade(ratio)}'>{text}</span>")
        rows.append(cells)
    text = "<p class='note'>RMS position error in the joint's unit; the redder, the further above the noise floor.</p>"
    return text + table(["joint", *[f"{h} s" for h in error]], rows, range(1, 1 + len(error)))


def _torque(report: Gap) -> str:
    document = report.document
    lacking = document["missing_torque"]
    if not lacking:
        return "<p>Too few windows to say.</p>"
    rows = []
    for joint, entry in lacking.items():
        on = escape(", ".join(entry["depends_on"])) or "no single quantity"
        share = share_of(entry["structured_rms"], entry["drive_rms"])
        quiet = f"<span class='note'>{escape(nothing_seen(document, joint, report.thresholds.report.verdicts))}</span>"
        rows.append(
            [
                f"{escape(joint)} [{entry['unit']}]",
                number(entry["mean"]),
                number(entry["structured_rms"]) if entry["significant"] else "-",
                share if entry["significant"] else "-",
                on if entry["significant"] else quiet,
                probability(entry["p"]),
            ]
        )
    head = ["joint", "constant", "RMS", "share of drive torque", "depends on", "p"]
    text = (
        "<p class='note'>Torque that the declared model lacks, by the tests that a diagnosis applies to its own rest: "
        "basis functions of the motion, confirmed on rollouts that took no part, and whether a free torque in every "
        "fifth of a window explains more than sensor noise does. p is corrected for the number of functions or joints."
        "</p>"
    )
    return text + table(head, rows, (1, 2, 3, 5))


def _clouds(report: Gap) -> list[str]:
    """Missing torque over velocity and position of the joints with most structure."""
    if report.torque is None:
        return []
    names = [j.joint for j in report.torque.left.joints]
    worst = [j for j, e in report.document["missing_torque"].items() if e["significant"]]
    parts = []
    for joint in worst[: report.thresholds.gap.page.pictures]:
        position, velocity, torque = report.torque.cloud(names.index(joint))
        lacks = f"missing torque [{of_joint(report.document, joint, 'torque')}]"
        pair = [
            cloud_picture(
                values, torque, f"{name} [{of_joint(report.document, joint, name)}]", lacks, f"{joint} over {name}"
            )
            for name, values in (("velocity", velocity), ("position", position))
        ]
        shown = "".join(figure(p, escape(f"{joint}: mean in equally filled bins, 95 % interval")) for p in pair)
        parts.append(f"<div class='row'>{shown}</div>")
    return parts


def _reported(document: dict[str, Any]) -> list[str]:
    table_ = document["reported_torque"]
    if not table_:
        return []
    rows = [
        [
            f"{escape(j)} [{of_joint(document, j, 'torque')}]",
            number(e["gain"]),
            number(e["bias"]),
            f"{1e3 * e['delay']:.1f}",
            number(e["correlation"]),
        ]
        for j, e in table_.items()
    ]
    text = (
        "<p class='note'>The drive's reported torque against what the declared drive would give at the measured state. "
        "A gain or delay here is the drive's; the rest of the error is friction, inertia or load.</p>"
    )
    head = ["joint", "gain", "bias", "delay [ms]", "correlation"]
    return ["<h2>Reported drive torque</h2>", text, table(head, rows, (1, 2, 3, 4))]


def _motions(motions: list[dict[str, Any]], most: int) -> str:
    rows = [
        [
            escape(m["cluster"]) or "-",
            escape(m["motion"]),
            str(m["windows"]),
            motion_error(m),
        ]
        for m in motions[:most]
    ]
    more = f"<p class='note'>and {len(motions) - most} more</p>" if len(motions) > most else ""
    horizon = motions[0]["horizon"] if motions else "0.2"
    return table(["cluster", "motion", "windows", f"RMS error after {horizon} s"], rows, (2, 3)) + more
