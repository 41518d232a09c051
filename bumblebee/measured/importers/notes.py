"""The notes of an import as a person is told them: each once, with the number of rollouts that have it."""

import json
from collections import Counter
from pathlib import Path

import pyarrow.parquet as pq

from bumblebee.measured.metadata import METADATA_KEY
from bumblebee.measured.rollout import rollout_files

_SHOWN = 20


def notes_of(dataset: Path) -> list[str]:
    """Lines on what was left out, sorted, held or made in an imported dataset; they stand in the metadata, too."""
    counts: Counter[str] = Counter()
    for file in rollout_files(dataset):
        meta = json.loads((pq.read_schema(file).metadata or {}).get(METADATA_KEY, b"{}"))
        counts.update(dict.fromkeys(filter(None, str(meta.get("notes") or "").split("; ")), 1))
    lines = [f"note ({count} rollouts): {note}" for note, count in counts.most_common(_SHOWN)]
    more = len(counts) - len(lines)
    lines += [f"{more} more notes in the rollouts' metadata"] * bool(more)
    # Names come from files: no control character of theirs reaches a terminal.
    return ["".join(sign if sign.isprintable() else "\ufffd" for sign in line) for line in lines]
