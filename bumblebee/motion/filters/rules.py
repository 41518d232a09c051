"""Kinematic rules that a motion must satisfy to be worth learning (paper, section 4.1; limits as in ProtoMotions).

Each rule is a function from a clip to its worst frame; a motion that exceeds the rule's limit is dropped, and the
drop is written down with the value, the frame and a sentence. Penetration, airborne time, body and joint speed have
ProtoMotions' limits; the others are ours, set so that they catch what is broken and not what is hard.
"""

from collections.abc import Callable, Iterable

import pandas as pd

from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.body_rules import (
    body_speed,
    joint_limits,
    joint_speed,
    root_dip,
    root_jump,
    root_turn,
    self_collision,
    spike,
)
from bumblebee.motion.filters.config import FilterConfig
from bumblebee.motion.filters.floor_rules import airborne, floating, floor_penetration, other_contact, skate
from bumblebee.motion.filters.worst import Worst

__all__ = ["DROP_COLUMNS", "RULES", "FilterConfig", "filter_clips", "row_of", "violations"]

DROP_COLUMNS = ("motion", "rule", "value", "limit", "unit", "frame", "time", "explanation")

# In this order: the first that a motion breaks is its reason where there may be one only.
RULES: tuple[Callable[[Clip, FilterConfig], Worst], ...] = (
    floor_penetration,
    floating,
    airborne,
    joint_limits,
    body_speed,
    joint_speed,
    root_dip,
    root_jump,
    root_turn,
    spike,
    skate,
    self_collision,
    other_contact,
)


def violations(clip: Clip, config: FilterConfig | None = None) -> list[dict[str, object]]:
    """The rules that a clip breaks, as rows of `DROP_COLUMNS`."""
    rows = []
    for rule in RULES:
        worst = rule(clip, config or FilterConfig())
        if worst.value > worst.limit:
            rows.append(row_of(clip, rule.__name__, worst))
    return rows


def row_of(clip: Clip, rule: str, worst: Worst) -> dict[str, object]:
    """A broken rule as a row of `DROP_COLUMNS`."""
    time = worst.frame / clip.fps
    said = f"{worst.explanation} (frame {worst.frame}, {time:.2f} s); the limit is {worst.limit:g} {worst.unit}"
    facts = (round(worst.value, 4), worst.limit, worst.unit, worst.frame, round(time, 3), said)
    return dict(zip(DROP_COLUMNS, (clip.name, rule, *facts), strict=True))


def filter_clips(clips: Iterable[Clip], config: FilterConfig | None = None) -> tuple[list[Clip], pd.DataFrame]:
    """The clips that break no rule, and a table of what the others break, a row for each rule broken."""
    kept, drops = [], []
    for clip in clips:
        broken = violations(clip, config)
        drops += broken
        if not broken:
            kept.append(clip)
    return kept, pd.DataFrame(drops, columns=list(DROP_COLUMNS))
