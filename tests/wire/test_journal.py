"""Journals: what was written is read back, a torn end costs the torn end, and a run becomes a measured rollout."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.learning.export import export_shipped
from bumblebee.measured.intake import intake
from bumblebee.measured.rollout import read_rollout
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.robot.facts import joint_names
from bumblebee.robot.model import build_model
from bumblebee.wire.clock import SECOND
from bumblebee.wire.journal import Writer, layout, read_journal, record
from bumblebee.wire.links.line import LineFaults
from bumblebee.wire.messages import Mode
from bumblebee.wire.rehearsal import Rehearsal
from bumblebee.wire.rollouts import asked, ended_by, latency, rollout_of
from bumblebee.wire.safety.phases import Phase
from bumblebee.wire.session import write_down
from tests.wire.small import small_records

ABOUT = {"id": "nod-1", "joints": ["hip", "knee", "ankle"], "control_hz": 50.0, "robot": "g1_23dof", "motion": "nod"}
G1 = ABOUT | {"joints": list(joint_names()), "policy": {"name": "shipped", "version": "", "sha256": "0" * 64}}


def test_what_was_written_is_read_back_and_never_over_a_file(tmp_path: Path) -> None:
    path, records = tmp_path / "a.journal", small_records()
    writer = Writer(path, ABOUT)
    writer.add(records)
    writer.close()
    about, rows = read_journal(path)
    assert about == {"journal": 1, **ABOUT} and rows.tobytes() == records and len(rows) == 100
    assert rows["order"].tolist() == list(range(100)) and set(rows["robot_mode"]) <= {int(mode) for mode in Mode}
    with pytest.raises(BadInput, match="new file"):
        Writer(path, ABOUT)


def test_a_torn_end_costs_the_records_that_were_torn_and_no_other(tmp_path: Path) -> None:
    path, records, size = tmp_path / "a.journal", small_records(), layout(3).itemsize
    head = json.dumps({"journal": 1, **ABOUT}).encode() + b"\n"
    for end, left in ((40 * size + 17, 40), (len(records), 100), (size - 1, 0), (0, 0)):
        path.write_bytes(head + records[:end])
        assert len(read_journal(path)[1]) == left
    path.write_bytes(head + records[: 30 * size] + bytes(5 * size) + records[35 * size :])  # a block that never came
    assert len(read_journal(path)[1]) == 30


def test_what_is_no_journal_is_one_line(tmp_path: Path) -> None:
    for content in (b"", b"x\n", b"{}\n", b'{"joints": 1}\n', b'{"joints": [], "journal": 9}\n'):
        (tmp_path / "a.journal").write_bytes(content)
        with pytest.raises(BadInput, match="journal"):
            read_journal(tmp_path / "a.journal")


def test_a_kill_loses_at_most_a_second(tmp_path: Path) -> None:
    """Written by a process that is killed: all that it said it had added is there."""
    code = (
        "import sys; from pathlib import Path; from bumblebee.wire.journal import Writer\n"
        "from tests.wire.small import small_records\n"
        "about = {'id': 'a', 'joints': ['a', 'b', 'c'], 'control_hz': 50}\n"
        "records, writer = small_records(), Writer(Path(sys.argv[1]), about)\n"
        "while True: writer.add(records); print('added', flush=True)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path / "a.journal")], stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]
    )
    assert process.stdout is not None
    added = [process.stdout.readline() for _ in range(3)]
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert added == [b"added\n"] * 3 and len(read_journal(tmp_path / "a.journal")[1]) >= 300


def rows_of(run: Rehearsal) -> np.ndarray:
    return np.frombuffer(b"".join(record(entry, 23) for entry in run.entries()), layout(23))


def test_a_run_becomes_a_rollout_that_the_intake_has_nothing_against(
    rehearsal: Callable[..., Rehearsal], shipped: ExportedPolicy, tmp_path: Path
) -> None:
    run = rehearsal(noise=1.0, state_hz=500, states=LineFaults(delay=0.001, jitter=0.001, dropped=0.02))
    rows = rows_of(run)
    assert run.guard.reason == "" == ended_by(rows)
    rollout = rollout_of(G1, rows)
    assert rollout.frames >= 25 and rollout.base_pos is None
    assert np.diff(rollout.time) == pytest.approx(0.02, abs=0.0045)
    writer = Writer(tmp_path / "nod-1.journal", G1)
    writer.add(rows.tobytes())
    writer.close()
    path = write_down(tmp_path / "nod-1.journal", tmp_path / "dataset")
    assert path is not None and (tmp_path / "dataset" / "model.xml").is_file()
    contracts = {"": shipped.contract}
    sorted_ = intake(tmp_path / "dataset", tmp_path / "good", tmp_path / "bad", build_model(), contracts)
    assert [path.name for path in (tmp_path / "good").iterdir()] == ["nod-1.parquet"], sorted_.findings
    assert read_rollout(path).meta["kp"] == pytest.approx(shipped.contract["kp"], rel=1e-6)
    with pytest.raises(BadInput, match="never-overwritten"):
        write_down(tmp_path / "nod-1.journal", tmp_path / "dataset")


def test_the_wires_latency_is_known_by_the_robots_own_stamps(rehearsal: Callable[..., Rehearsal]) -> None:
    """An answer goes out one tick after the question: 5 ms, and what lines and the robot's own period add."""
    quick, slow = (
        latency(
            rows_of(rehearsal(frames=8, state_hz=500, states=LineFaults(delay=delay), orders=LineFaults(delay=delay)))
        )
        for delay in (0.0, 0.003)
    )
    assert quick is not None and slow is not None
    assert 0.005 <= quick.median <= 0.009 and slow.median - quick.median == pytest.approx(0.006, abs=0.0011)


def test_a_row_has_the_state_that_the_policy_saw_and_the_target_that_went_out_for_it(
    rehearsal: Callable[..., Rehearsal],
) -> None:
    entries = list(rehearsal().entries())
    rows = np.frombuffer(b"".join(record(entry, 23) for entry in entries), layout(23))
    rollout, asks = rollout_of(G1, rows), asked(rows)
    for k, ask in enumerate(asks):
        question, sent = entries[ask].tick.question, entries[ask + 1].tick.order.target
        assert question is not None and entries[ask].tick.phase is Phase.RUN
        np.testing.assert_allclose(rollout.joint_pos[k], question.state.joint_pos, atol=1e-6)
        np.testing.assert_allclose(rollout.joint_target[k], sent, atol=1e-6)
        assert rollout.time[k] * SECOND == pytest.approx(question.state.stamp_ns - rows["robot_ns"][asks[0]], abs=1)


def test_a_run_that_never_carried_itself_is_no_rollout(tmp_path: Path) -> None:
    writer = Writer(tmp_path / "a.journal", ABOUT)
    writer.add(small_records(0.1))
    writer.close()
    assert write_down(tmp_path / "a.journal", tmp_path / "dataset") is None
    assert not (tmp_path / "dataset").exists()


def test_a_policy_of_imu_and_encoders_runs_a_robot_without_odometry_whose_log_lacks_the_column(
    rehearsal: Callable[..., Rehearsal], tmp_path: Path
) -> None:
    imu = ExportedPolicy.load(export_shipped(tmp_path / "imu", "imu"))
    run = rehearsal(policy=imu, odometry=False)
    rollout = rollout_of(G1, rows_of(run))
    assert run.guard.reason == "" and not run.guard.intake.refused
    assert len(rollout.time) >= 25 and rollout.base_lin_vel is None and rollout.base_ang_vel is not None


def test_a_policy_that_needs_odometry_never_begins_where_there_is_none(rehearsal: Callable[..., Rehearsal]) -> None:
    run = rehearsal(odometry=False)
    run.longest = 2.0
    list(run.entries())
    assert (
        run.guard.reason == "silent" and run.guard.intake.state is None and run.guard.intake.refused["no numbers"] > 0
    )
