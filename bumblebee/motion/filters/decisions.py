"""The decision about each motion: what the rules say, what a person says, and how the counts add up."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pandas as pd

from bumblebee.motion.filters.overrule import Overrule
from bumblebee.motion.filters.rules import DROP_COLUMNS

OVERRULED = "overruled"
"""The reason of a motion that a person drops and no rule does."""
DECISION_COLUMNS = (
    *("motion", "decision", "by_rules", "rules", "value", "limit", "unit", "frame", "time", "explanation"),
    *("overruled_by", "overruled_because"),
)


@dataclass(frozen=True)
class Decision:
    """Decision on one motion."""

    motion: str
    broken: tuple[dict[str, object], ...] = ()
    """The rules that it breaks, as rows of `DROP_COLUMNS`, in the order of the rules."""
    overrule: Overrule | None = None

    @property
    def by_rules(self) -> str:
        """Decision of the rules alone: keep or drop."""
        return "drop" if self.broken else "keep"

    @property
    def decision(self) -> str:
        """Decision that holds: keep or drop."""
        return self.overrule.decision if self.overrule else self.by_rules

    @property
    def first_reason(self) -> str:
        """Why it is dropped, one reason a motion; "" of one that is kept."""
        if self.decision == "keep":
            return ""
        return str(self.broken[0]["rule"]) if self.broken else OVERRULED

    def row(self) -> dict[str, object]:
        """As a row of `DECISION_COLUMNS`; value, limit and frame are those of the first rule broken."""
        first = dict(self.broken[0]) if self.broken else dict.fromkeys(DROP_COLUMNS)
        word = self.overrule
        return {
            **first,
            "motion": self.motion,
            "decision": self.decision,
            "by_rules": self.by_rules,
            "rules": ";".join(str(row["rule"]) for row in self.broken),
            "overruled_by": word.who if word else "",
            "overruled_because": word.reason if word else "",
        }


def decisions_table(decisions: Iterable[Decision]) -> pd.DataFrame:
    """One row a motion, columns `DECISION_COLUMNS`."""
    table = pd.DataFrame([one.row() for one in decisions], columns=list(DECISION_COLUMNS))
    return table.astype({"frame": "Int64"})  # a frame's number stays whole beside motions that have none


def drops_table(decisions: Iterable[Decision]) -> pd.DataFrame:
    """Table of what was dropped, a row for each broken rule; one dropped by a person alone has the rule `overruled`."""
    rows: list[dict[str, object]] = []
    for one in decisions:
        if one.decision == "drop":
            word = one.overrule
            said = f"{word.who}: {word.reason}" if word else ""
            own: dict[str, object] = {"motion": one.motion, "rule": OVERRULED, "explanation": said}
            rows += [dict(row) for row in one.broken] or [own]
    return pd.DataFrame(rows, columns=list(DROP_COLUMNS))


@dataclass(frozen=True)
class Accounting:
    """Counts of motions: `read` = `kept` + `dropped`, and the first reasons sum to `dropped`."""

    read: int
    kept: int
    dropped: int
    by_first_reason: dict[str, int]
    by_rule: dict[str, int]
    """Motions that break a rule, whatever became of them; one that breaks two is counted twice."""
    kept_by_word: int
    """Kept by a person against the rules."""
    dropped_by_word: int
    """Dropped by a person where no rule was broken."""


def accounting(decisions: Sequence[Decision]) -> Accounting:
    """The counts of a set of decisions."""
    first = Counter(one.first_reason for one in decisions if one.decision == "drop")
    return Accounting(
        read=len(decisions),
        kept=sum(one.decision == "keep" for one in decisions),
        dropped=sum(one.decision == "drop" for one in decisions),
        by_first_reason=dict(first.most_common()),
        by_rule=dict(Counter(str(row["rule"]) for one in decisions for row in one.broken).most_common()),
        kept_by_word=sum(one.decision == "keep" and one.by_rules == "drop" for one in decisions),
        dropped_by_word=sum(one.decision == "drop" and one.by_rules == "keep" for one in decisions),
    )
