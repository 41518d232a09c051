"""The policy of BumbleBee's own that a loop went on from."""

import json
from pathlib import Path

from bumblebee.learning.pretrained import NAMES


def came_along(base: Path) -> Path | None:
    """Folder of the policy that comes with BumbleBee and that the base policy began from, if it did."""
    card = base / "card.json"
    parent = json.loads(card.read_text()).get("parent") if card.exists() else None
    return next((folder for folder, name in NAMES.items() if name == parent), None)
