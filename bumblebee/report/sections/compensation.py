"""Compensation at the joint, without training: the plan beside each round's diagnosis."""

from dataclasses import dataclass

from bumblebee.report.effect_words import named
from bumblebee.report.page import Block, Cell, table
from bumblebee.report.results import Json


@dataclass(frozen=True)
class Planned:
    """One found effect and what becomes of it."""

    effect: str
    where: tuple[str, ...]
    done: bool
    """Whether the runner undoes it."""
    what: str
    """Action, or why there is none."""

    @property
    def named(self) -> str:
        """`backlash, L knee`."""
        return named({"effect": self.effect, "where": self.where})


def planned(document: Json | None) -> tuple[Planned, ...]:
    """The entries of compensation.json; the only function that knows its keys.

    `done` says how an effect is undone, `size` with which numbers, `why_not` why it is not; else empty.
    """
    return tuple(
        Planned(
            str(entry["effect"]),
            tuple(entry.get("where") or ()),
            bool(entry.get("done")),
            "; ".join(str(entry[key]) for key in ("done", "size", "why_not") if entry.get(key)),
        )
        for entry in (document or {}).get("plan", [])
    )


def compensation_line(document: Json | None) -> str:
    """`Undone at the joint: 2 of 3; left: backlash, L knee.`; "" where there is no plan."""
    entries = planned(document)
    if not entries:
        return ""
    left = [entry.named for entry in entries if not entry.done]
    done = f"Undone at the joint, without training: {len(entries) - len(left)} of {len(entries)}"
    return f"{done}; left: {'; '.join(left)}." if left else f"{done}."


def compensation_table(document: Json | None) -> list[Block]:
    """Table of what is undone and how, effect by effect; nothing where there is no plan."""
    rows = [(e.named, Cell("undone", "found") if e.done else "left", e.what) for e in planned(document)]
    return [table(("effect", "at the joint", "how, or why not"), rows, "", "compensation")] if rows else []
