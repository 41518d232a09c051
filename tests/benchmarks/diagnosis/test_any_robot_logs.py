"""Nine random robots with random logs: each diagnosis ends, with a document of the contract or with one line."""

import copy
import json
import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.any_robot_logs.__main__ import is_well, main, read, run
from benchmarks.any_robot_logs.case import draw
from benchmarks.any_robot_logs.robot import SMALL, Size, make_robot
from benchmarks.any_robot_logs.validate import problems
from bumblebee.diagnosis.diagnose import Diagnosis
from bumblebee.diagnosis.simulation import LEFT_OUT
from tests.diagnosis import arm

COUNT = 9  # one with a refused model, of every integrator but one, fixed and floating


@pytest.fixture(scope="module")
def rows() -> list[dict]:
    return list(run(range(COUNT), quick=True, each=60.0))


def test_every_diagnosis_ends_with_a_valid_document_or_with_one_line(rows: list[dict]) -> None:
    assert sorted(row["seed"] for row in rows) == list(range(COUNT))
    assert [row for row in rows if not is_well(row)] == []


def test_no_step_of_the_search_had_to_be_left_out(rows: list[dict]) -> None:
    """Models may be impossible; a step that cannot be computed is a mistake of ours."""
    assert [note for row in rows for note in row.get("failures", []) if note.startswith(LEFT_OUT)] == []


def test_most_of_them_are_diagnosed_and_some_refused(rows: list[dict]) -> None:
    outcomes = [row["outcome"] for row in rows]
    assert outcomes.count("done") >= 0.6 * COUNT and "refused" in outcomes


@pytest.mark.slow
def test_five_hundred_end_too(tmp_path: Path) -> None:
    """Small ones again; `python -m benchmarks.any_robot_logs` has those of full size."""
    out = tmp_path / "results.jsonl"
    assert (
        main(["--quick", "--first", str(COUNT), "--limit", str(500 - COUNT), "--workers", "2", "--out", str(out)]) == 0
    )
    assert len(read(out)) == 500 - COUNT


def test_the_same_seed_draws_the_same_case() -> None:
    one, other = draw(5, SMALL), draw(5, SMALL)
    assert one.robot.xml == other.robot.xml and one.about == other.about
    np.testing.assert_array_equal(one.rollouts[0].joint_pos, other.rollouts[0].joint_pos)


def test_every_kind_of_robot_is_drawn() -> None:
    """Kinds that a draw must reach: joints, drives, bases, looks, what couples joints."""
    robots = [make_robot(np.random.default_rng([19, seed]), Size()) for seed in range(300)]
    words = {word for robot in robots for word in robot.about}
    assert words >= {
        "fixed", "floating", "position", "motor", "velocity", "general", "dcmotor", "none", "geoms", "mesh", "tendon",
        "equality", "weld", "two drives on a joint", "drive on a tendon", "Euler", "RK4", "implicit", "implicitfast",
    }  # fmt: skip
    assert min(len(r.joints) for r in robots) == 1 and max(len(r.joints) for r in robots) == 30


def test_a_process_that_dies_costs_its_case_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A child that was killed or printed no row for a seed."""
    import subprocess

    calls: list[list[str]] = []

    def fake(command: list[str], **given) -> subprocess.CompletedProcess:
        calls.append(command)
        seeds = [int(s) for s in command[command.index("--child") + 1].split(",")]
        lines = [json.dumps({"seed": s, "outcome": "done", "problems": []}) for s in seeds if s != 2]
        lines = lines[: seeds.index(2)] if 2 in seeds else lines
        return subprocess.CompletedProcess(command, -6, "\n".join(lines), "Fatal Python error: Aborted")

    monkeypatch.setattr(subprocess, "run", fake)
    rows = {row["seed"]: row for row in run([1, 2, 3], quick=True, each=1.0)}
    assert rows[2]["outcome"] == "aborted" and "Fatal Python error" in rows[2]["text"]
    assert is_well(rows[1]) and is_well(rows[3]) and not is_well(rows[2]) and len(calls) == 2


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    from bumblebee.diagnosis.diagnose import diagnose

    return diagnose(arm.session_of(arm.simulate({("coulomb_friction", "j2"): 0.4}, count=3)), arm.SMALL)


def test_a_document_of_a_diagnosis_keeps_the_contract(diagnosis: Diagnosis) -> None:
    document = json.loads(json.dumps(diagnosis.document))
    assert document["effects"] and problems(document) == []


def _first(document: dict) -> dict:
    return next(iter(document["effects"][0]["parameters"].values()))


BREAKS = {
    "no key": lambda d: d.pop("unexplained"),
    "another schema": lambda d: d.update(schema=2),
    "no number": lambda d: _first(d).update(value=math.nan),
    "an interval the wrong way round": lambda d: _first(d).update(ci95=[2.0, 1.0]),
    "a value outside of its interval": lambda d: _first(d).update(ci95=[-9.0, -8.0]),
    "an effect of another catalogue": lambda d: d["effects"][0].update(effect="magic"),
    "a probability of 2": lambda d: d["unexplained"].update(p=2.0),
    "another horizon": lambda d: d["error"]["after"].update({"7": {}}),
    "no floor": lambda d: d["error"].pop("floor"),
    "a note of two lines": lambda d: d["notes"].append("one\ntwo"),
    "a rollout fitted and held out": lambda d: d["holdout"].append(d["train"][0]),
}


@pytest.mark.parametrize("name", BREAKS)
def test_a_document_that_breaks_the_contract_is_seen(diagnosis: Diagnosis, name: str) -> None:
    document = copy.deepcopy(json.loads(json.dumps(diagnosis.document)))
    BREAKS[name](document)
    assert problems(document) != []
