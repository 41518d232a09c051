"""Success rates with their intervals: policies side by side, by family or cluster of motion."""

from typing import Any

from bumblebee.report.figures import INK, canvas, colour, svg_uri


def pick(results: list[dict[str, Any]], **wanted: Any) -> list[dict[str, Any]]:
    """Entries of the evaluation summary that have the wanted values."""
    return [entry for entry in results if all(entry[key] == value for key, value in wanted.items())]


def success_figure(
    results: list[dict[str, Any]], policies: list[str], engine: str, group_by: str, split: str = "all"
) -> str | None:
    """Image URI of one group of bars a family or cluster; None where there is nothing to show."""
    entries = {
        (entry["policy"], entry["group"]): entry
        for entry in pick(results, engine=engine, split=split, group_by=group_by)
        if entry["policy"] in policies
    }
    groups = sorted({group for _, group in entries})
    if not groups:
        return None
    figure, (axis,) = canvas(1, height=2.9)
    width = 0.82 / len(policies)
    for i, policy in enumerate(policies):
        for g, group in enumerate(groups):
            entry = entries.get((policy, group))
            if entry is None or entry["success"]["value"] is None:
                continue
            value, (low, high) = entry["success"]["value"], entry["success"]["ci95"]
            x = g - 0.41 + (i + 0.5) * width
            axis.bar(x, value, width * 0.9, color=colour(i), label=policy if g == 0 else None)
            axis.plot([x, x], [low, high], color=INK, lw=1)
    counts = {group: entries[p, group]["success"]["motions"] for p, group in entries}
    axis.set_xticks(range(len(groups)), [f"{group}\n{counts[group]} motions" for group in groups])
    axis.set(ylim=(0, 1.04), ylabel="success rate")
    axis.grid(axis="x", visible=False)
    axis.legend(fontsize=8, ncols=min(len(policies), 5), loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return svg_uri(figure)
