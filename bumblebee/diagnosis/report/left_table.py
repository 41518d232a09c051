"""The page's table of what is left, in units of the task, ranked."""

from collections.abc import Mapping
from html import escape
from typing import Any

from bumblebee.diagnosis.report.headline import sized
from bumblebee.diagnosis.report.html import number, table

_BASE = {"pos": "base position", "rot": "base rotation"}


def what_is_left_table(document: Mapping[str, Any]) -> str:
    """A row a joint, part of the base and end of a chain; nothing of a document without its block `summary`."""
    told = document.get("summary")
    if not told or not told["left"]:
        return ""
    missing = {entry["where"]: entry for entry in told["structure"]}
    rows = []
    for entry in told["left"]:
        name, block = entry["where"], document["error"]["before"].get(told["horizon"], {})
        first = block.get(f"base_{name}_rmse", {})
        if entry["what"] == "joint":
            first = block.get("joint_pos_rmse", {}).get("per_joint", {}).get(name, {})
        rows.append(
            [escape(_BASE.get(name, name) if entry["what"] == "base" else name), *_sizes(first.get("value"), entry)]
        )
        rows[-1].append(_missing(missing.get(name)))
    rows += [
        [f"{escape(entry['where'])} <span class='note'>(end)</span>", *_sizes(entry["before"], entry), ""]
        for entry in told["ends"]
    ]
    head = [
        f"after {told['horizon']} s",
        "left [95 % interval]",
        "declared",
        "noise",
        "share",
        "missing torque with structure",
    ]
    text = (
        "<p class='note'>RMS error of windows that start from measured states. Share: of the squared error above the "
        "noise, over all joints. (end): where the joints' errors put the last body of a chain, the base as measured. "
        "Chi-square: the remaining one, in which every reading counts by its noise. Grey: significant, but next to "
        "nothing of it.</p>"
    )
    return "<h2>What is left</h2>" + table(head, rows, (1, 2, 3, 4)) + text


def _sizes(first: float | None, entry: Mapping[str, Any]) -> list[str]:
    """Left with its interval, declared, noise and share."""
    unit, ends = entry["unit"], entry.get("ci95")
    span = f" <span class='note'>[{sized(ends[0], unit)}, {sized(ends[1], unit)}]</span>" if ends else ""
    share = f"{100 * entry['share']:.0f} %" if entry.get("share") is not None else ""
    noise = sized(entry["noise"], unit) if entry.get("noise") is not None else ""
    return [f"<span class='strong'>{sized(entry['value'], unit)}</span>{span}", sized(first, unit), noise, share]


def _missing(entry: Mapping[str, Any] | None) -> str:
    if entry is None:
        return ""
    share = "" if entry["explains"] is None else f": {100 * entry['explains']:.0f} % of chi-square"
    on = f" on {', '.join(entry['depends_on'])}" if entry["depends_on"] else ""
    text = escape(f"{number(entry['torque'], 2)} {entry['unit']} RMS{on}{share}")
    return text if entry["proclaimed"] else f"<span class='note'>{text}</span>"
