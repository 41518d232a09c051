"""Parts of a round's diagnosis that later stages read."""

import json

from tasks.running import paths


def split(round: int) -> tuple[set[str], set[str]]:
    """Ids of the rollouts that the diagnosis fitted, and of those that it held out."""
    content = json.loads(paths.diagnosis_document(round).read_text())
    return set(content["train"]), set(content["holdout"])
