"""Motions that a policy to go on from has learnt from, whose licences its children keep."""

import os
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.read import read_json
from bumblebee.learning import pretrained
from bumblebee.policy.card_text import CARD, NOTHING


def learnt_before(start: str) -> list[str]:
    """Motions that a policy to go on from has learnt from, and their licences; a line for it and each of its parents.

    Args:
        start: the name of a shipped policy, a policy's folder, or "nothing".

    Raises:
        BadInput: the folder's card.json is not one of a policy.
    """
    if start == NOTHING:
        return []
    if start in pretrained.SHIPPED:
        return [f"`{start}`: {pretrained.MOTIONS[pretrained.SHIPPED[start]]}"]
    file = Path(start).expanduser() / CARD
    card = read_json(file) if os.path.lexists(file) else {}
    licences, before = (card.get("licences", {}), card.get("learnt_before", [])) if isinstance(card, dict) else (0, 0)
    if not isinstance(licences, dict) or not isinstance(before, list):
        raise BadInput(file, "a policy's card", "other contents", "Restore it, or remove it.")
    told = ", ".join(f"{licence} ({count})" for licence, count in licences.items())
    return [*map(str, before), f"`{start}`: {told or 'licences unknown, see its card'}"]
