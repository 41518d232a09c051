"""The policy that a loop went on from: one that comes with BumbleBee, or the user's own."""

import json
from pathlib import Path
from typing import Literal

from bumblebee.api.learnt import learnt_before
from bumblebee.learning.pretrained import MOTIONS, NAMES
from tasks.running import paths


def began(base: Path) -> Literal["scratch", "shipped", "own"]:
    """Where the policy in `base` went on from."""
    if came_along(base):
        return "shipped"
    return "own" if _parent(base) == str(paths.POLICY) else "scratch"


def came_along(base: Path) -> Path | None:
    """Folder of the policy that comes with BumbleBee and that the base policy began from, if it did."""
    return next((folder for folder, name in NAMES.items() if name == _parent(base)), None)


def seen_before(base: Path) -> list[str]:
    """Motions from which the policy that the base policy began from had learnt, with their licences, a line each."""
    if folder := came_along(base):
        return [f"`{NAMES[folder]}`: {MOTIONS[folder]}"]
    return learnt_before(str(paths.POLICY)) if began(base) == "own" else []


def _parent(base: Path) -> str | None:
    card = base / "card.json"
    return json.loads(card.read_text()).get("parent") if card.exists() else None
