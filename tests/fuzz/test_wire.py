"""Messages, journals and limits, damaged in any way: what was meant, or one line."""

from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.wire.journal import read_journal
from bumblebee.wire.links.lcm_codec import Codec, decode_card, encode_card
from bumblebee.wire.rollouts import rollout_of
from bumblebee.wire.safety.limits import Limits, read_limits
from tests.fuzz.budget import rounds
from tests.fuzz.test_overrule import damaged
from tests.wire.made import card, order, state
from tests.wire.small import small_records

CODEC = Codec(3)
MESSAGES = {
    CODEC.state: CODEC.encode_state(state()),
    CODEC.order: CODEC.encode_order(order()),
    decode_card: encode_card(card()),
}
HEAD = b'{"journal": 1, "id": "a", "joints": ["hip", "knee", "ankle"], "control_hz": 50.0, "motion": "nod"}\n'


LIMITS = b"# how far this robot may go\n" * 20 + b"tilt_deg: 20\nspeed: 0.5\nhot: 90.0\nmissed: 3\n"


def one_line(error: BadInput) -> bool:
    return len(str(error).splitlines()) == 1 and len(str(error)) < 1500


def test_a_damaged_message_is_read_or_refused_in_one_line() -> None:
    refused = taken = 0
    for number in rounds(0.1):
        rng = np.random.default_rng(number)
        decode, good = list(MESSAGES.items())[number % 3]
        try:
            decode(damaged(good, rng))
            taken += 1
        except BadInput as error:
            refused += 1
            assert one_line(error)
    assert refused > 0 and taken > 0


def test_a_damaged_journal_gives_whole_records_or_one_line(tmp_path: Path) -> None:
    records, path, refused, taken = small_records(1.2), tmp_path / "a.journal", 0, 0
    for number in rounds(0.2):
        rng = np.random.default_rng(number)
        path.write_bytes(damaged(HEAD, rng) + records if number % 2 else HEAD + damaged(records, rng))
        try:
            about, rows = read_journal(path)
            taken += 1
            rollout_of(about, rows)
        except BadInput as error:
            refused += 1
            assert one_line(error)
    assert refused > 0 and taken > 0


def test_a_damaged_file_of_limits_gives_limits_or_one_line(tmp_path: Path) -> None:
    path, refused, taken = tmp_path / "limits.yaml", 0, 0
    for number in rounds(0.1):
        path.write_bytes(damaged(LIMITS, np.random.default_rng(number)))
        try:
            assert isinstance(read_limits(path), Limits)
            taken += 1
        except BadInput as error:
            refused += 1
            assert one_line(error)
    assert refused > 0 and taken > 0
