"""The soak's judge: what it lets pass, and that each way in which a lab can lose something breaks its verdict."""

import contextlib
import copy
import json
import re
import sqlite3
from pathlib import Path

import pytest

from benchmarks.lab_soak import facts, faults, said
from benchmarks.lab_soak.judge import judge, undisturbed
from benchmarks.lab_soak.record import Event, Record, read

SHA = "0123abc"


def run(name: str) -> Event:
    return {
        "name": name,
        "run": f"id of {name}",
        "status": "FINISHED",
        "params": 12,
        "points": 4,
        "files": ["lineage.json", "policy/policy.onnx"],
        "lineage": True,
        "git_sha": SHA,
        "stage": name,
        "versions": [],
    }


def left(seed: int) -> Event:
    """Event of a loop that left its files."""
    files = {"models/base/policy.onnx": f"hash of seed {seed}", "models/base/card.json": "b"}
    return {"seed": seed, "stages": ["base", "filter"], "files": files, "runs": [run("base"), run("filter")]}


def record() -> list[Event]:
    """Two loops; in the first a worker is killed, and the loop is started again."""
    killed = {"kind": faults.WORKER, "target": 0}
    return [
        {"what": "begin", "at": 0.0, "git_sha": SHA},
        {"what": "reference", "at": 1.0, **left(0)},
        {"what": "reference", "at": 2.0, **left(1)},
        {"what": "stands", "at": 3.0},
        {"what": "start", "at": 10.0, "loop": 1, "attempt": 1},
        {"what": "stage", "at": 20.0, "loop": 1, "name": "filter"},
        {"what": "fault", "at": 30.0, **killed},
        {"what": "restored", "at": 50.0, **killed},
        {"what": "end", "at": 55.0, "loop": 1, "attempt": 1, "status": 1, "said": []},
        {"what": "start", "at": 60.0, "loop": 1, "attempt": 2},
        {"what": "stage", "at": 75.0, "loop": 1, "name": "base"},
        {"what": "end", "at": 80.0, "loop": 1, "attempt": 2, "status": 0, "said": []},
        {"what": "loop", "at": 81.0, "loop": 1, **left(1)},
        {"what": "start", "at": 90.0, "loop": 2, "attempt": 1},
        {"what": "end", "at": 120.0, "loop": 2, "attempt": 1, "status": 0, "said": []},
        {"what": "loop", "at": 121.0, "loop": 2, **left(0)},
    ]


def of(events: list[Event], what: str) -> Event:
    return next(event for event in events if event["what"] == what)


def test_a_soak_that_lost_nothing_holds_and_says_how_soon_it_went_on() -> None:
    found = judge(record())
    assert found.broken == []
    assert found.faults == [[faults.WORKER, "1", "1", "45", "45"]]  # from the blow at 30 to the stage at 75
    assert found.counts["stages finished"] == 2 and found.counts["loops finished"] == 2


def corrupted_hash(loop: Event) -> None:
    loop["files"]["models/base/policy.onnx"] = "another"


def lost_file(loop: Event) -> None:
    del loop["files"]["models/base/card.json"]


def lost_run(loop: Event) -> None:
    loop["runs"].pop()


def doubled_run(loop: Event) -> None:
    loop["runs"].append(copy.deepcopy(loop["runs"][0]))


def unfinished_run(loop: Event) -> None:
    loop["runs"].append({**loop["runs"][0], "status": "RUNNING"})


def lost_points(loop: Event) -> None:
    loop["runs"][0]["points"] -= 1


def lost_artifact(loop: Event) -> None:
    loop["runs"][0]["files"].remove("policy/policy.onnx")


def another_lineage(loop: Event) -> None:
    loop["runs"][0]["lineage"] = False


def another_commit(loop: Event) -> None:
    loop["runs"][0]["git_sha"] = "fedc"


def doubled_version(loop: Event) -> None:
    loop["runs"][0]["versions"] = ["base READY", "base READY"]


def lost_stage(loop: Event) -> None:
    loop["stages"].remove("base")


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (corrupted_hash, "models/base/policy.onnx: another hash"),
        (lost_file, "models/base/card.json: no such file"),
        (lost_run, "run `filter` is lost"),
        (doubled_run, "run `base` is there 2 times"),
        (unfinished_run, "run `base` is RUNNING, beside 1 finished"),
        (lost_points, "run `base`: points 3, expected 4"),
        (lost_artifact, "run `base`: its files differ by ['policy/policy.onnx']"),
        (another_lineage, "run `base`: lineage.json is not the one that its tag names"),
        (another_commit, "run `base`: commit fedc, expected 0123abc"),
        (doubled_version, "run `base`: versions ['base READY', 'base READY'], expected []"),
        (lost_stage, "stage base is missing"),
    ],
)
def test_what_is_lost_doubled_or_changed_breaks_the_verdict(change, line: str) -> None:
    events = record()
    change(of(events, "loop"))
    assert judge(events).broken == [f"loop 1, seed 1: {line}"]


def test_an_equal_policy_that_was_published_before_needs_no_new_run() -> None:
    events = record()
    version = {**run("publish base"), "versions": ["base READY"]}
    references = [event for event in events if event["what"] == "reference"]
    loops = [event for event in events if event["what"] == "loop"]
    for event in (*references, *loops):
        event["runs"] = [*event["runs"], copy.deepcopy(version)]
    assert judge(events).broken == []
    loops[0]["runs"].pop()
    assert judge(events).broken == ["loop 1, seed 1: run `publish base` is lost"]
    events.insert(4, {**left(1), "what": "loop", "at": 4.0, "loop": 0, "runs": [run("base"), run("filter"), version]})
    assert judge(events).broken == []


def test_a_loop_that_hung_or_was_given_up_breaks_it() -> None:
    events = record()
    of(events, "end")["status"] = "hung"
    assert judge(events).broken == ["loop 1, start 1: hung"]
    events = [e for e in record() if not (e.get("loop") == 1 and e.get("attempt") == 2) and e["what"] != "loop"]
    assert "loop 1: given up" in judge(events).broken
    assert "loop 2: done, and never read" in judge(record()[:-1]).broken


def test_an_error_needs_a_name_and_its_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    named = {"lost worker": (re.compile("its machine was lost"), (faults.WORKER,))}
    monkeypatch.setattr(said, "NAMED", named)
    monkeypatch.setattr("benchmarks.lab_soak.judge.NAMED", named)
    events = record()
    of(events, "end")["said"] = ["base: its machine was lost"]
    found = judge(events)
    assert found.broken == [] and found.lines == {"lost worker": 1}
    of(events, "end")["said"] = ["KeyError: 'x'"]
    assert judge(events).broken == ["loop 1, start 1: an error without a name: KeyError: 'x'"]
    quiet = [event for event in record() if event["what"] not in ("fault", "restored")]
    of(quiet, "end")["said"] = ["base: its machine was lost"]
    assert judge(quiet).broken == ["loop 1, start 1: lost worker, without such a fault: base: its machine was lost"]


def test_what_no_fault_disturbed_is_told_apart() -> None:
    events = record()
    assert undisturbed(events) == 0.0  # the fault lies between the two stages, and a new start does
    calm = [event for event in events if event["what"] not in ("fault", "restored")]
    calm.insert(5, {"what": "stage", "at": 16.0, "loop": 1, "name": "motions"})
    assert undisturbed(sorted(calm, key=lambda event: event["at"])) == 4.0


def test_a_soak_without_a_finished_loop_does_not_hold() -> None:
    assert "no loop was finished" in judge([e for e in record() if e["what"] != "loop"]).broken


def test_the_schedule_is_its_seeds_and_has_every_kind_before_any_twice() -> None:
    hour = faults.schedule(3, 3600, 300, 200, 2)
    assert hour == faults.schedule(3, 3600, 300, 200, 2) != faults.schedule(4, 3600, 300, 200, 2)
    assert [fault.at for fault in hour if fault.kind == faults.WORKER] == [300.0 * n for n in range(1, 12)]
    others = [fault.kind for fault in hour if fault.kind != faults.WORKER]
    assert sorted(others[: len(faults.OTHERS)]) == sorted(faults.OTHERS)


def test_lines_that_tell_are_kept_once_for_each_shape() -> None:
    lines = ["23:00:01.123 base | trained 4 iterations", "23:00:02.1 base | Error: run 17 lost"]
    text = "\n".join([*lines, "Error: run 18 lost", "base | Error: run 3 lost"])
    assert said.telling(text) == ["base | Error: run 17 lost", "Error: run 18 lost"]
    assert said.telling("12:00:01 exceptional-alpaca | 10 of 10 stages have work to do") == []
    assert said.telling("ValueException: 3") == ["ValueException: 3"]


def test_what_nobody_foresaw_has_no_name_wherever_it_is_said() -> None:
    line = "publish | failed after 0:09 min: this machine / {} OperationalError: connection refused"
    assert said.name_of(line.format("expected the lab's")) is not None
    assert said.name_of(line.format("internal error:")) is None
    kept = "base | base: its machine was lost; another one goes on from its last checkpoint"
    assert said.name_of(kept) == said.name_of("base: its machine was lost; the stage starts again on another one")


def test_how_long_a_training_took_is_no_difference_and_all_else_is() -> None:
    card = {"parameters": 3, "seconds": 1.5, "frames_per_second": 20.0}
    slower = json.dumps({**card, "seconds": 9.0, "frames_per_second": 1.0}).encode()
    other = json.dumps({**card, "parameters": 4}).encode()
    name = "models/base/card.json"
    ours = facts.timeless(name, json.dumps(card).encode())
    assert ours == facts.timeless(name, slower) != facts.timeless(name, other)
    curve = b"iteration,seconds,reward\n1,3.3,.06\n"
    assert facts.timeless("curve.csv", curve) == facts.timeless("curve.csv", curve.replace(b"3.3", b"9.9"))
    assert facts.timeless("curve.csv", curve) != facts.timeless("curve.csv", curve.replace(b".06", b".07"))
    assert facts.timeless("policy.onnx", b"1") != facts.timeless("policy.onnx", b"2")


def test_a_record_that_was_cut_is_read_to_its_last_whole_line(tmp_path: Path) -> None:
    kept = Record(tmp_path / "record.jsonl")
    kept.write("begin", minutes=1)
    kept.write("start", loop=1)
    with kept.path.open("a") as file:
        file.write('{"what": "en')
    assert [event["what"] for event in read(kept.path)] == ["begin", "start"]


def test_the_judge_is_shown_active_runs_alone() -> None:
    """A repeated stage deletes what its earlier start has written, and MLflow's tables keep it, marked."""
    with contextlib.closing(sqlite3.connect(":memory:")) as tables:
        tables.executescript(
            "CREATE TABLE experiments (experiment_id, name); CREATE TABLE params (run_uuid);"
            "CREATE TABLE metrics (run_uuid);"
            "CREATE TABLE runs (run_uuid, name, status, artifact_uri, experiment_id, start_time, lifecycle_stage);"
            "INSERT INTO experiments VALUES (1, 'soak');"
            "INSERT INTO runs VALUES ('a', 'base', 'RUNNING', '', 1, 1, 'deleted'),"
            "('b', 'base', 'FINISHED', '', 1, 2, 'active');"
        )
        assert [row[0] for row in tables.execute(facts.RUNS, {"name": "soak"})] == ["b"]


def test_a_line_of_training_progress_is_no_error_though_it_says_key_error() -> None:
    line = "base | train base: 128/128 frames (100 %), 12.3 frames/s, 0:00 left, success nan, key error 0.047 m"
    assert said.telling(f"11:02:28 {line}") == [line]
    assert said.name_of(line) == "no error: how a policy did"
    assert said.name_of("base: key error in the settings") != "no error: how a policy did"
