"""Cross-validation beside `mujoco.sysid`: equal data for both, and a fit that finds what it is told to fit."""

from pathlib import Path

import pytest

from benchmarks.diagnosis import beside_sysid
from bumblebee.measured.rollout import write_rollout
from tests.diagnosis import arm


def test_every_rollout_is_held_out_once() -> None:
    names = [f"r{i}" for i in range(7)]
    parts = beside_sysid.folds(names, names, 3)
    assert sorted(name for part in parts for name in part) == names
    assert {len(part) for part in parts} == {2, 3}


def test_repeats_of_a_motion_are_held_out_together() -> None:
    assert beside_sysid.folds(["a", "b", "c", "d"], ["m", "n", "o", "m"], 2) == [["a", "c", "d"], ["b"]]


def test_what_is_told_to_be_wrong_is_found_with_its_size() -> None:
    session = arm.session_of(arm.simulate({("coulomb_friction", "j2"): 0.3}, count=2, seed=3))
    found = beside_sysid.identified(session, ["coulomb_friction"], windows=16, horizon=0.2)
    assert [effect.where for effect in found] == [("j1",), ("j2",), ("j3",)]
    sizes = [effect.parameters["frictionloss"] for effect in found]
    assert sizes[1] == pytest.approx(0.3, abs=0.02)
    assert max(sizes[0], sizes[2]) < 0.02
    before, after = (beside_sysid.judged(session, effects)["0.2"] for effects in ([], found))
    assert after < 0.5 * before  # what is left is the noise


def test_too_few_rollouts_for_the_folds_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "set" / "rollouts").mkdir(parents=True)
    (tmp_path / "model.xml").write_text(arm.XML)
    for rollout in arm.simulate({}, count=2, seconds=1.0):
        write_rollout(tmp_path / "set" / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
    words = [str(tmp_path / "model.xml"), str(tmp_path / "set"), "--parameters", "armature"]
    with pytest.raises(SystemExit, match="2"):
        beside_sysid.main(words)
    assert "expected at least 6 rollouts, came 2" in capsys.readouterr().out
