"""Files that overrule the filter, damaged in any way: rows that are complete, or one line."""

from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.filters.overrule import COLUMNS, DECISIONS, by_clip, read_overrules
from tests.fuzz.budget import rounds

CLIPS = ["walk", "kick_p0", "kick_p1"]
FILES = {
    "word.csv": b'motion,decision,reason,who\nwalk,keep,"fine, looked at it",Ada\nkick,drop,limps,Bob\n',
    "word.yaml": b"- {motion: walk, decision: keep, reason: fine, who: Ada}\n- motion: kick\n  decision: drop\n"
    b"  reason: &a limps\n  who: Bob\n",
}
PIECES = (b",", b"\n", b'"', b"\r", b"\0", b"\xff", b"walk", b"- ", b": ", b"{", b"!!python/object:os.system ", b"*a")


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """A few bytes changed, cut out, put in or repeated."""
    for _ in range(rng.integers(1, 5)):
        at, end = sorted(rng.integers(0, len(data) + 1, 2))
        kind = rng.integers(4)
        if kind == 0:
            data = data[:at] + PIECES[rng.integers(len(PIECES))] + data[at:]
        elif kind == 1:
            data = data[:at] + data[end:]
        elif kind == 2:
            data = data[:end] + data[at:]
        else:
            data = data[:at] + bytes([rng.integers(256)]) + data[at + 1 :]
    return data


def test_a_damaged_file_gives_complete_rows_or_one_line(tmp_path: Path):
    refused = taken = 0
    for number in rounds(0.3):
        rng = np.random.default_rng(number)
        name = list(FILES)[number % len(FILES)]
        path = tmp_path / name
        path.write_bytes(damaged(FILES[name], rng))
        try:
            rows = read_overrules(path)
            found = by_clip(rows, CLIPS, path)
        except BadInput as error:
            refused += 1
            assert len(str(error).splitlines()) == 1 and len(str(error)) < 1500
            continue
        taken += 1
        assert set(found) <= set(CLIPS)
        assert all(one.decision in DECISIONS and all(getattr(one, key) for key in COLUMNS) for one in rows)
    assert refused > 0 and taken > 0
