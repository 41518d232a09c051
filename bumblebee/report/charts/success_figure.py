"""Success rates by policy and by family or cluster of motion, as a shaded grid whose cells say their intervals."""

from typing import Any

from bumblebee.report.page import Block, Cell, table
from bumblebee.report.wording import percent, plural


def pick(results: list[dict[str, Any]], **wanted: Any) -> list[dict[str, Any]]:
    """Entries of the evaluation summary that have the wanted values."""
    return [entry for entry in results if all(entry[key] == value for key, value in wanted.items())]


def success_grid(results: list[dict[str, Any]], policies: dict[str, str], engine: str, by: str) -> list[Block]:
    """A row for each policy and a column for each family or cluster; nothing where nothing was evaluated.

    Args:
        results: entries of the evaluation summary.
        policies: their names in `results` and what they are called here.
        engine: "stand_in" or "nominal".
        by: "family" or "cluster".
    """
    entries = {
        (entry["policy"], entry["group"]): entry
        for entry in pick(results, engine=engine, split="all", group_by=by)
        if entry["policy"] in policies and entry["success"]["value"] is not None
    }
    groups = sorted({group for _, group in entries})
    rows: list[tuple[str | Cell, ...]] = [
        (called, *(_cell(entries.get((policy, group)), f"{called}, {group or 'unknown'}") for group in groups))
        for policy, called in policies.items()
        if any((policy, group) in entries for group in groups)
    ]
    header = (f"[%] by {by}", *(group or "unknown" for group in groups))
    caption = "Motions followed to the end [%]; pointing at a number shows its 95 % interval."
    return [table(header, rows, caption, f"success by {by}")] if rows else []


def _cell(entry: dict[str, Any] | None, what: str) -> Cell:
    if entry is None:
        return Cell("–")
    success = entry["success"]
    tip = f"{what}: {percent(success)} of {plural(success['motions'], 'motion')}"
    return Cell(f"{100 * success['value']:.0f}", shade=success["value"], tip=tip)
