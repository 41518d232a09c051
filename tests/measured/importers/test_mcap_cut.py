"""An MCAP file that ends anywhere, as after a crash, is read up to its last whole message."""

from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.measured.importers import read_rollouts
from bumblebee.measured.importers.ros.mcap_file import read_mcap
from bumblebee.measured.importers.ros.recording import Recording
from tests.measured.importers.recordings import SAME_CLOCK, joint_messages, write_mcap
from tests.measured.simulated import ARM_JOINTS, arm_rollout

pytest.importorskip("mcap_ros2")

TOPICS = ("/command", "/joint_states")
MAGIC = 8


def messages(found: Recording) -> list[bytes]:
    return [one.data for name in TOPICS if name in found.topics for one in found.topics[name].messages]


@pytest.fixture(scope="module", params=["NONE", "ZSTD", "LZ4"])
def whole(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("cut") / "run.mcap"
    write_mcap(path, joint_messages(arm_rollout(0, seconds=1.2), ARM_JOINTS), request.param)
    return path.read_bytes()


def test_at_every_place_of_the_cut_what_lies_before_it_is_read_and_a_note_says_how_far(whole: bytes) -> None:
    """Every seventh place and each of the last 300: records begin at any byte, and 7 divides no length of theirs."""
    every, before = messages(read_mcap("run", whole, TOPICS, LIMITS)), 0
    for size in [*range(MAGIC, len(whole) - 300, 7), *range(len(whole) - 300, len(whole))]:
        found = read_mcap("run", whole[:size], TOPICS, LIMITS)
        count = len(messages(found))
        assert before <= count and set(messages(found)) <= set(every)
        (note,) = found.notes
        assert f"of {size:,}" in note and "read as far as it goes" in note
        before = count
    assert before == len(every) and not read_mcap("run", whole, TOPICS, LIMITS).notes


@pytest.mark.parametrize("kind", ["NONE", "ZSTD", "LZ4"])
def test_messages_of_the_chunk_that_was_being_written_are_read_too(tmp_path: Path, kind: str) -> None:
    """All messages lie in one chunk, of which a fifth is missing; zstd gives back whole blocks of 128 kB."""
    sent = joint_messages(arm_rollout(0, hz=200.0), ARM_JOINTS)
    write_mcap(tmp_path / "run.mcap", sent, kind, chunk=1 << 24)
    content = (tmp_path / "run.mcap").read_bytes()
    chunk, place = 6, MAGIC
    while content[place] != chunk:
        place += 9 + int.from_bytes(content[place + 1 : place + 9], "little")
    length = int.from_bytes(content[place + 1 : place + 9], "little")
    found = read_mcap("run", content[: place + int(0.8 * length)], TOPICS, LIMITS)
    assert len(sent) / 3 < len(messages(found)) < len(sent)


def test_the_rollout_of_a_recording_that_was_cut_off_is_its_beginning(tmp_path: Path) -> None:
    rollout = arm_rollout(0)
    path = tmp_path / "cut.mcap"
    write_mcap(path, joint_messages(rollout, ARM_JOINTS))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    (tmp_path / "map.yaml").write_text(SAME_CLOCK)
    (ours,) = read_rollouts(path, "rosbag", column_map=tmp_path / "map.yaml")
    assert 10 < ours.frames < rollout.frames and "read as far as it goes" in ours.meta["notes"]
    np.testing.assert_allclose(ours.joint_pos, rollout.joint_pos[: ours.frames])


def test_a_record_that_leads_beyond_a_finished_file_is_damage_and_no_missing_end(whole: bytes) -> None:
    damaged = bytearray(whole)
    damaged[MAGIC + 5] = 1  # the header's length grows by 4 GiB
    with pytest.raises(BadInput, match="an MCAP file"):
        read_mcap("run", bytes(damaged), TOPICS, LIMITS)


@pytest.mark.parametrize("content", [b"", b"\x89MCAP", b"no recording at all"])
def test_bytes_that_are_no_recording_are_one_line(content: bytes) -> None:
    with pytest.raises(BadInput, match=f"an MCAP file, came {len(content)} bytes that are none"):
        read_mcap("run", content, TOPICS, LIMITS)
