"""A corpus of bad rollouts: each is set aside by the intake, its batch goes on, and a session says one line."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from bumblebee.diagnosis.dataset.session import open_session
from bumblebee.errors import BadInput
from bumblebee.measured.intake import UNFORESEEN, intake
from bumblebee.measured.metadata import METADATA_KEY
from bumblebee.measured.rollout import BadRollout, write_rollout
from tests.measured.arm_file import model_file
from tests.measured.simulated import arm_model, arm_rollout


@pytest.mark.parametrize("name", ["../../x", "/x", "a/b", ".x", "", "a\0b", "\ud800", "x" * 300])
def test_a_rollout_under_a_name_that_leads_elsewhere_is_not_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadRollout, match="rollout-id"):
        write_rollout(tmp_path / "in" / "a.parquet", replace(arm_rollout(0), rollout_id=name))
    assert not list(tmp_path.iterdir())


def put(column: str, value: float) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        rollout = arm_rollout(0, seconds=2.0)
        values = getattr(rollout, column).copy()
        values[5:8] = value
        write_rollout(path, replace(rollout, rollout_id=path.stem, **{column: values}))

    return change


def told(**meta: object) -> Callable[[Path], None]:
    """A file whose metadata say something else."""

    def change(path: Path) -> None:
        write_rollout(path, replace(arm_rollout(0, seconds=2.0), rollout_id=path.stem))
        table = pq.read_table(path)
        said = json.loads(table.schema.metadata[METADATA_KEY]) | meta
        pq.write_table(table.replace_schema_metadata({METADATA_KEY: json.dumps(said).encode()}), path)

    return change


def raw(data: bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(data) and None


ROLLOUTS = {
    "1e200 in positions": put("joint_pos", 1e200),
    "1e200 in velocities": put("joint_vel", -1e200),
    "1e200 in targets": put("joint_target", 1e200),
    "1e200 in time": put("time", 1e200),
    "targets of 1e8": put("joint_target", 1e8),
    "targets of 1e5": put("joint_target", 1e5),
    "1e300 everywhere": put("joint_pos", 1e300),
    "tiny": put("time", 5e-324),
    "nan": put("joint_pos", np.nan),
    "a rate of text": told(control_hz="fast"),
    "a huge rate": told(control_hz=1e300),
    "huge gains": told(kp=[10**400] * 3),
    "infinite gains": told(kp=[float("inf")] * 3),
    "joints of numbers": told(joints=[1, 2, 3]),
    "joints with NUL": told(joints=["shoulder\0", "elbow", "wrist"]),
    "half a surrogate": told(motion="\ud800"),
    "a name elsewhere": told(rollout_id="../../x"),
    "deep": told(notes=json.loads("[" * 500 + "]" * 500)),
    "no Parquet": raw(b"PAR1 PAR1"),
    "nothing": raw(b""),
    "a folder": lambda path: path.mkdir(),
    "a link to nothing": lambda path: path.symlink_to("none"),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ROLLOUTS)
def test_a_bad_rollout_is_set_aside_the_batch_goes_on_and_a_session_says_one_line(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "in" / "rollouts"
    write_rollout(folder / "good.parquet", replace(arm_rollout(1, seconds=2.0), rollout_id="good"))
    ROLLOUTS[name](folder / "bad.parquet")
    batch = intake(tmp_path / "in", tmp_path / "good", tmp_path / "aside", arm_model())
    assert (batch.accepted, batch.quarantined) == (["good.parquet"], ["bad.parquet"])
    assert UNFORESEEN not in set(batch.findings.rule)
    assert (tmp_path / "aside" / "bad.parquet.findings.json").is_file()
    (folder / "good.parquet").unlink()
    with pytest.raises(BadInput) as caught:
        open_session(model_file(tmp_path), tmp_path / "in")
    assert "\n" not in str(caught.value)
