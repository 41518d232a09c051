"""The arms that log torques: what is drawn is what is scored, and a run that was ended goes on."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.diagnosis import torque_arms
from benchmarks.diagnosis.torque_arms import CASES, main, measured, run_of, true_sizes, truth_of, within
from bumblebee.sim.effects import single


@pytest.mark.parametrize("name", CASES)
def test_all_true_sizes_count_and_a_size_off_does_not(name: str) -> None:
    case = CASES[name]
    true = list(true_sizes(case))
    found = [single(kind, place, size, *([0.0] if kind == "coupled_friction" else [])) for kind, place, size in true]
    assert within(found, case) == (len(true), len(true))
    kind, place, size = true[0]
    off = single(kind, place, 1.1 * size, *([0.0] if kind == "coupled_friction" else []))
    assert within([off, *found[1:]], case) == (len(true) - 1, len(true))


def test_the_torque_that_is_logged_is_not_what_arrives_where_drives_are_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torque_arms, "SECONDS", 1)
    plain, weak = CASES["drawing, coupled wrist"], CASES["and drives 5 to 10 % off"]
    one, other, again = (run_of(truth_of(case), case, 0) for case in (plain, weak, plain))
    np.testing.assert_array_equal(one.joint_pos, again.joint_pos)
    assert np.abs(one.joint_pos - other.joint_pos).max() > 1e-3


def test_logs_that_are_there_are_kept_and_what_is_done_is_not_done_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torque_arms, "SECONDS", 1)
    monkeypatch.setattr(torque_arms, "RUNS", 2)
    ran: list[str] = []
    monkeypatch.setattr(torque_arms, "diagnose", lambda session: ran.append("diagnosed") or 1 / 0)
    case = CASES["coupled wrist alone"]
    for _ in range(2):  # ended after the logs were made
        with pytest.raises(ZeroDivisionError):
            measured(case, tmp_path / "case_0")
    assert ran == ["diagnosed"] * 2 and len(list((tmp_path / "case_0" / "rollouts").iterdir())) == 2
    monkeypatch.setattr(torque_arms, "CASES", {"coupled wrist alone": case})
    (tmp_path / "results.jsonl").write_text('{"case": "coupled wrist alone"}\n{"case": "cut sh')
    monkeypatch.setattr("sys.argv", ["torque_arms", "--out", str(tmp_path)])
    main()
    assert ran == ["diagnosed"] * 2
