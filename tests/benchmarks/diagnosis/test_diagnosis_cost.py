"""The data of the cost benchmark: rollouts of the wanted length and number that name their motion, sealed or not."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.diagnosis import diagnosis_cost
from bumblebee.measured.rollout import read_dataset


def test_repeats_of_a_motion_share_its_name_and_differ(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnosis_cost, "SECONDS", 1.4)
    model = diagnosis_cost.write_dataset(tmp_path / "plain", 2, 2, [])
    diagnosis_cost.write_dataset(tmp_path / "sealed", 2, 2, ["coulomb_friction"])
    plain, sealed = (read_dataset(tmp_path / name).rollouts for name in ("plain", "sealed"))
    assert model.exists()
    assert len(plain) == len(sealed) == 4
    assert {r.frames for r in plain} == {70}
    by_motion = {r.rollout_id: r for r in plain}
    assert by_motion["m00-0"].meta["motion"] == by_motion["m00-1"].meta["motion"] != by_motion["m01-0"].meta["motion"]
    assert np.abs(by_motion["m00-0"].joint_pos - by_motion["m00-1"].joint_pos).max() > 1e-3
    # The same noise, so the difference is the sealed friction's.
    rubbed = {r.rollout_id: r for r in sealed}["m00-0"]
    column = plain[0].joints.index(diagnosis_cost.SEALED["coulomb_friction"][0])
    assert np.abs(rubbed.joint_pos - by_motion["m00-0"].joint_pos)[:, column].max() > 1e-3


def test_a_commands_memory_is_its_own_and_not_an_earlier_ones() -> None:
    """In a process that has had little memory itself, for its children count that, too."""
    commands = [[sys.executable, "-c", text] for text in ("x = b'1' * 1_000_000_000", "pass")]
    text = f"from benchmarks.diagnosis.diagnosis_cost import cost; print(*[cost(c)[2] for c in {commands}])"
    done = subprocess.run([sys.executable, "-c", text], check=True, capture_output=True, text=True)
    large, small = map(float, done.stdout.split())
    assert large > 950
    assert small < 0.8 * large


def test_a_command_that_fails_is_no_measurement() -> None:
    with pytest.raises(subprocess.CalledProcessError, match="status 3"):
        diagnosis_cost.cost([sys.executable, "-c", "raise SystemExit(3)"])
