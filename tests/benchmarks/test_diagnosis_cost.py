"""The data of the cost benchmark: rollouts of the wanted length and number that name their motion, sealed or not."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import diagnosis_cost
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
