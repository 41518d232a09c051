"""Success rates with their intervals: policies side by side, by family or cluster of motion."""

from typing import Any

from bumblebee.report.figures import GRID, canvas, colour, legend_below, short, svg_uri
from bumblebee.report.wording import plural


def pick(results: list[dict[str, Any]], **wanted: Any) -> list[dict[str, Any]]:
    """Entries of the evaluation summary that have the wanted values."""
    return [entry for entry in results if all(entry[key] == value for key, value in wanted.items())]


def success_figure(
    results: list[dict[str, Any]], policies: dict[str, str], engine: str, group_by: str, split: str = "all"
) -> str | None:
    """Image URI: a point with its 95 % interval for each policy, by family or cluster; None for nothing.

    `policies`: their names in `results` and what they are called here.
    """
    entries = {
        (entry["policy"], entry["group"]): entry
        for entry in pick(results, engine=engine, split=split, group_by=group_by)
        if entry["policy"] in policies
    }
    groups = sorted({group for _, group in entries})
    if not groups:
        return None
    step = 0.8 / len(policies)
    figure, axis = canvas(height=0.7 + len(groups) * max(0.5, 0.13 * len(policies)))
    for i, (policy, called) in enumerate(policies.items()):
        for g, group in enumerate(groups):
            entry = entries.get((policy, group))
            if entry is None or entry["success"]["value"] is None:
                continue
            value, (low, high) = entry["success"]["value"], entry["success"]["ci95"]
            y = g - 0.4 + (i + 0.5) * step
            axis.plot([100 * low, 100 * high], [y, y], color=colour(i), lw=1.5)
            axis.plot([100 * value], [y], "o", ms=4.5, color=colour(i))
        axis.plot([], [], "-o", ms=4.5, lw=1.5, color=colour(i), label=called)
    counts = {group: entries[p, group]["success"]["motions"] for p, group in entries}
    names = [f"{short(group or 'unknown', 14)}\n{plural(counts[group], 'motion')}" for group in groups]
    axis.set_yticks(range(len(groups)), names)
    for g in range(1, len(groups)):
        axis.axhline(g - 0.5, color=GRID)
    axis.set(xlim=(-3, 103), ylim=(len(groups) - 0.5, -0.5), xlabel="motions followed to the end [%]")
    axis.grid(axis="y", visible=False)
    legend_below(figure, axis)
    return svg_uri(figure)
