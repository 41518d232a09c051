"""Real processes on real wires, in slow motion: a whole run, and a guard whose console or policy is gone."""

import dataclasses
import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.learning.export import export_shipped
from bumblebee.measured.rollout import read_rollout
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.wire import realtime
from bumblebee.wire.clock import Clock
from bumblebee.wire.job import Job, decode_job, encode_job
from bumblebee.wire.journal import read_journal
from bumblebee.wire.links import packets
from bumblebee.wire.links.lcm_codec import Codec
from bumblebee.wire.links.link import open_link
from bumblebee.wire.messages import ORDER, STATE, Mode, Order
from bumblebee.wire.operator.keys import Keys, encode_keys
from bumblebee.wire.policy_end.policy_process import serve
from bumblebee.wire.policy_end.questions import (
    Answer,
    Question,
    decode_answer,
    decode_question,
    encode_answer,
    encode_question,
)
from bumblebee.wire.robot_end.robot import RobotSettings, WireRobot
from bumblebee.wire.robot_end.robot_process import require_alone
from bumblebee.wire.rollouts import ended_by
from bumblebee.wire.safety.guard_process import END, RECORD
from bumblebee.wire.safety.limits import Limits
from bumblebee.wire.safety.phases import Phase
from bumblebee.wire.session import Run, run
from tests.policy.conftest import nod
from tests.wire.conftest import SHORT
from tests.wire.made import state
from tests.wire.small import answer_to, drives, plan
from tests.wire.test_links import address, dds_here, lcm_here

HOME = Path(__file__).parents[2]
SLOW = 4.0
SLOWER = 10.0  # where the robot's own deadline of 20 ms counts, which no setting makes longer
PATIENT = Limits(
    state_hold=0.2, state_damp=0.5, policy_hold=0.2, policy_damp=0.5, deaf=2.0, console=1.0, missed=1000
)  # a busy machine is no fault of a robot's
CODEC = Codec(3)


def test_a_job_is_read_back_as_it_was() -> None:
    job = Job("sim", "x", 2.0, plan(), drives())
    read = decode_job(encode_job(job))
    assert dataclasses.replace(read, plan=job.plan, drives=job.drives) == job
    assert read.plan.hold.tolist() == job.plan.hold.tolist() and read.plan.ramps == job.plan.ramps
    assert read.drives.joints == job.drives.joints and (read.drives.kp == job.drives.kp).all()


def test_packets_stay_whole_and_say_when_the_other_side_is_gone() -> None:
    one, other = packets.pair()
    assert packets.received(one) == []
    assert all(packets.send(other, bytes([k]) * 2000) for k in range(50))
    other.close()
    assert packets.received(one) == [bytes([k]) * 2000 for k in range(50)]
    one, other = packets.pair()
    packets.send(one, b"nobody reads this")
    packets.send(other, b"last word")
    other.close()
    assert packets.received(one) == [b"last word"]
    for gone in (lambda: packets.received(one), lambda: packets.send(one, b"x")):
        with pytest.raises(packets.Gone):
            gone()


class Around:
    """A robot, a policy and a console around a guard in a process of its own."""

    def __init__(self, tmp_path: Path) -> None:
        at, self.clock = str(tmp_path / "w"), Clock(SLOW)
        self.link = open_link("sim", [ORDER], at)
        (self.console, theirs), (self.policy, worker) = packets.pair(), packets.pair()
        job = Job("sim", at, SLOW, plan(frames=10**6, limits=PATIENT), drives())
        fds = (theirs.fileno(), worker.fileno())
        words = [sys.executable, "-m", "bumblebee.wire.safety.guard_process", encode_job(job), *map(str, fds)]
        self.process = subprocess.Popen(words, pass_fds=fds, cwd=HOME, env=os.environ | {"PYTHONPATH": str(HOME)})
        theirs.close()
        worker.close()
        self.state, self.orders = state(sequence=0, stamp_ns=1, controller=0, heard=-1, mode=Mode.OFF), list[Order]()
        self.console_lives = self.policy_lives = True
        self.told: list[bytes] = []

    def until(self, done: Callable[[], bool]) -> None:
        """Play all three until it is so."""
        end = self.clock.now() + 30_000_000_000
        while not done():
            assert self.clock.now() < end, [order.mode for order in self.orders[-3:]]
            self.link.wait(0.005)
            for _, message in self.link.received():
                self._obey(CODEC.order(message))
            self.state = dataclasses.replace(
                self.state, sequence=self.state.sequence + 1, stamp_ns=self.state.stamp_ns + 5_000_000
            )
            self.link.send(STATE, CODEC.encode_state(self.state))
            try:
                self._talk()
            except packets.Gone:
                assert done() or self.process.wait(10) == 0
                return

    def _talk(self) -> None:
        if self.console_lives:
            self.told += packets.received(self.console)
            packets.send(self.console, encode_keys(Keys(self.clock.now(), goes=2)))
        for message in packets.received(self.policy):
            if self.policy_lives:
                packets.send(self.policy, encode_answer(answer_to(decode_question(message, CODEC))))

    def _obey(self, order: Order) -> None:
        self.orders.append(order)
        self.state = dataclasses.replace(
            self.state,
            joint_pos=order.target if order.kp.any() else self.state.joint_pos,
            joint_vel=np.zeros(3),
            mode=order.mode,
            controller=order.controller,
            heard=order.sequence,
        )

    def ran(self) -> bool:
        return len(self.orders) > 10 and all(order.mode is Mode.RUN for order in self.orders[-10:])

    def is_off(self) -> bool:
        return bool(self.orders) and self.orders[-1].mode is Mode.OFF and len(self.orders) > 10


def test_when_the_console_dies_the_guard_damps_switches_off_and_ends(tmp_path: Path) -> None:
    around = Around(tmp_path)
    around.until(around.ran)
    around.console_lives = False
    around.console.close()
    around.until(around.is_off)
    modes = [order.mode for order in around.orders]
    assert modes[modes.index(Mode.RUN) :].index(Mode.DAMP) < modes[modes.index(Mode.RUN) :].index(Mode.OFF)
    assert around.process.wait(10) == 0
    around.link.close()


def test_when_the_policy_hangs_the_guard_damps_and_says_why(tmp_path: Path) -> None:
    around = Around(tmp_path)
    around.until(around.ran)
    around.policy_lives = False
    around.until(lambda: bool(around.told) and around.told[-1][:1] == END)
    ended = json.loads(around.told[-1][1:])
    assert ended["reason"] == "policy_late" and around.process.wait(10) == 0
    assert {message[:1] for message in around.told[:-1]} == {RECORD}
    around.link.close()


def test_the_policys_process_answers_the_newest_question_and_ends_with_its_guard() -> None:
    class Quick:
        def answer(self, question: Question) -> Answer:
            return answer_to(question)

    ours, theirs = packets.pair()
    for tick in range(3):
        packets.send(ours, encode_question(Question(tick, tick, state()), CODEC))
    ours.shutdown(socket.SHUT_WR)
    serve(Quick(), Quick(), theirs, 3)  # type: ignore[arg-type]
    assert [decode_answer(message, 3).tick for message in packets.received(ours)] == [2]


def test_the_guard_comes_first_the_policy_second_and_the_robot_third(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[int]()
    monkeypatch.setattr(realtime.ctypes, "CDLL", lambda name: SimpleNamespace(mlockall=lambda which: 1))
    monkeypatch.setattr(os, "sched_setscheduler", lambda pid, kind, param: asked.append(param.sched_priority))
    monkeypatch.setattr(realtime, "gc", SimpleNamespace(collect=int, freeze=int, disable=int))
    for priority in (realtime.GUARD, realtime.POLICY, realtime.ROBOT):
        realtime.harden(priority)
    assert asked == [60, 50, 40]


def test_the_brain_that_is_kept_warm_answers_the_last_question_again_and_nobody_hears_it() -> None:
    again = threading.Event()

    class Warm:
        def answer(self, question: Question) -> None:
            again.set()

    class Quick:
        def answer(self, question: Question) -> Answer:
            return answer_to(question)

    ours, theirs = packets.pair()
    packets.send(ours, encode_question(Question(5, 5, state()), CODEC))
    serving = threading.Thread(target=serve, args=(Quick(), Warm(), theirs, 3))
    serving.start()
    assert again.wait(30.0)
    ours.shutdown(socket.SHUT_WR)
    serving.join()
    assert [decode_answer(message, 3).tick for message in packets.received(ours)] == [5]


def test_a_second_robot_on_a_wire_is_refused(tmp_path: Path) -> None:
    at = address("sim", tmp_path)
    require_alone("sim", at)
    first = WireRobot([], RobotSettings(), 0)
    link, ended = open_link("sim", [ORDER], at), threading.Event()

    def live() -> None:
        while not ended.wait(0.02):
            for channel, message in first.advance(first.next_period, []):
                link.send(channel, message)

    living = threading.Thread(target=live)
    living.start()
    try:
        with pytest.raises(BadInput, match="wire sim: expected no robot on it yet, came states of one"):
            require_alone("sim", at)
    finally:
        ended.set()
        living.join()
        link.close()


LCM = pytest.param("lcm", marks=[pytest.mark.slow, pytest.mark.skipif(not lcm_here(), reason="no lcm or multicast")])
DDS = pytest.param("unitree", marks=[pytest.mark.slow, pytest.mark.skipif(not dds_here(), reason="no cyclonedds")])


@pytest.mark.parametrize("wire", ["sim", LCM, DDS])
def test_a_policy_runs_a_robot_in_another_process_and_its_log_is_a_dataset(
    wire: str, shipped: ExportedPolicy, tmp_path: Path
) -> None:
    at, policy = address(wire, tmp_path), shipped.folder
    if wire == "unitree":  # LowState_ has no odometry
        policy = export_shipped(tmp_path / "policy", "imu")
    code = (
        "from bumblebee.wire.robot_end.robot_process import run_robot\n"
        "from bumblebee.wire.robot_end.robot import RobotSettings\n"
        f"run_robot({wire!r}, {at!r}, [], RobotSettings(state_hz=250), {SLOWER}, 60.0, print)"
    )
    words, places = [sys.executable, "-u", "-c", code], os.pathsep.join((str(HOME), *sys.path))
    env = os.environ | {"PYTHONPATH": places}
    robot = subprocess.Popen(words, cwd=HOME, env=env, stdout=subprocess.PIPE)
    assert robot.stdout is not None
    try:
        robot.stdout.readline()  # it is there
        job = Run(policy, nod(frames=12), wire, tmp_path / "set", at, None, PATIENT, SHORT, True, SLOWER, "a test")
        ended, path = run(job)
    finally:
        robot.kill()
        robot.wait()
    assert ended.reason == "" and path is not None
    rollout = read_rollout(path)
    assert rollout.frames >= 12 and rollout.meta["operator"] == "a test" and rollout.meta["motion"] == "nod"
    (journal,) = (tmp_path / "set" / "journals").iterdir()
    _, rows = read_journal(journal)
    assert set(Phase(phase) for phase in rows["phase"]) == set(Phase) and ended_by(rows) == ""
    assert ended.numbers.table()["policy"][0] > 0 and (tmp_path / "set" / "model.xml").is_file()
