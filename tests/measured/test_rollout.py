"""The contract's file: what is written is read back, and what does not keep the contract is named."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.rollout import BadRollout, Rollout, read_dataset, read_rollout, write_rollout


def made(rollout_id: str = "a", rows: int = 7, seed: int = 0) -> Rollout:
    draw = np.random.default_rng(seed).normal
    return Rollout(
        rollout_id,
        ("hip", "knee"),
        50,
        np.arange(rows) * 0.02 + 3.0,
        draw(size=(rows, 2)),
        draw(size=(rows, 2)),
        joint_target=draw(size=(rows, 2)),
        base_quat=draw(size=(rows, 4)),
        foot_force=draw(size=(rows, 2, 3)),
        meta={"robot": "r", "kp": [1.0, 2.0], "notes": "ä <b>", "policy": {"name": "p", "version": 3}},
    )


@pytest.mark.parametrize("seed", range(3))
def test_read_gives_back_what_was_written(tmp_path: Path, seed: int) -> None:
    rollout = made(seed=seed)
    write_rollout(tmp_path / "a.parquet", rollout)
    back = read_rollout(tmp_path / "a.parquet")
    assert back.meta == rollout.meta and back.joints == rollout.joints and back.control_hz == 50.0
    assert back.columns == rollout.columns
    for column in ("time", *rollout.columns):
        np.testing.assert_array_equal(getattr(back, column), getattr(rollout, column))
    assert [file.name for file in tmp_path.iterdir()] == ["a.parquet"]


def test_vectors_are_fixed_size_lists_and_metadata_is_one_json_object(tmp_path: Path) -> None:
    write_rollout(tmp_path / "a.parquet", made())
    schema = pq.read_schema(tmp_path / "a.parquet")
    assert schema.field("joint_pos").type == pa.list_(pa.float64(), 2)
    assert schema.field("foot_force").type == pa.list_(pa.list_(pa.float64(), 3), 2)
    assert json.loads(schema.metadata[b"bumblebee.rollout"])["schema"] == 1


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    write_rollout(tmp_path / "a.parquet", made())
    before = (tmp_path / "a.parquet").read_bytes()
    with pytest.raises(BadInput, match="never-overwritten"):
        write_rollout(tmp_path / "a.parquet", made(seed=1))
    assert (tmp_path / "a.parquet").read_bytes() == before


def rewritten(folder: Path, change: str) -> Path:
    """A file of the contract with one thing wrong."""
    path = folder / "a.parquet"
    write_rollout(path, made())
    table = pq.read_table(path)
    meta = json.loads(table.schema.metadata[b"bumblebee.rollout"])
    wide = pa.FixedSizeListArray.from_arrays(pa.array(np.zeros(21)), 3)
    if change in table.column_names:
        table = table.drop_columns([change])
    elif change == "wide":
        table = table.set_column(1, "joint_pos", wide)
    elif change == "lists":
        table = table.set_column(1, "joint_pos", table.column(1).cast(pa.list_(pa.float64())))
    elif change == "text":
        table = table.set_column(0, "time", pa.array(["x"] * 7))
    elif change == "short":
        table = table.slice(0, 1)
    elif change == "null":
        table = table.set_column(1, "joint_pos", pa.array([[0.0, 0.0]] * 4 + [None] * 3, pa.list_(pa.float64(), 2)))
    elif change == "schema":
        meta["schema"] = 2
    elif change == "twice":
        meta["joints"] = ["hip", "hip"]
    elif change == "id":
        meta["rollout_id"] = "../b"
    elif change == "kp":
        meta["kp"] = [1.0]
    elif change.startswith("no "):
        del meta[change[3:]]
    table = table.replace_schema_metadata({"bumblebee.rollout": json.dumps(meta)} if change != "bare" else None)
    path.unlink()
    pq.write_table(table, path)
    return path


@pytest.mark.parametrize(
    ("change", "column", "rule"),
    [
        ("time", "time", "required-column"),
        ("joint_vel", "joint_vel", "required-column"),
        ("joint_target", "joint_target", "command-column"),
        ("wide", "joint_pos", "column-width"),
        ("lists", "joint_pos", "column-type"),
        ("text", "time", "column-type"),
        ("short", "time", "length"),
        ("null", "", "readable"),
        ("schema", "bumblebee.rollout", "schema"),
        ("twice", "bumblebee.rollout", "joint-names"),
        ("id", "bumblebee.rollout", "rollout-id"),
        ("kp", "bumblebee.rollout", "metadata"),
        ("no joints", "bumblebee.rollout", "metadata"),
        ("no control_hz", "bumblebee.rollout", "metadata"),
        ("bare", "bumblebee.rollout", "metadata"),
    ],
)
def test_what_breaks_the_contract_is_named_with_file_column_and_rule(
    tmp_path: Path, change: str, column: str, rule: str
) -> None:
    path = rewritten(tmp_path, change)
    with pytest.raises(BadRollout) as caught:
        read_rollout(path)
    line = str(caught.value)
    assert (caught.value.column, caught.value.rule) == (column, rule)
    assert str(path) in line and column in line and rule in line and "\n" not in line


@pytest.mark.parametrize("size", [0, 10, 600])
def test_a_truncated_file_is_named(tmp_path: Path, size: int) -> None:
    write_rollout(tmp_path / "a.parquet", made())
    cut = tmp_path / "b.parquet"
    cut.write_bytes((tmp_path / "a.parquet").read_bytes()[:size])
    with pytest.raises(BadRollout, match="readable"):
        read_rollout(cut)


def test_shapes_are_checked_when_a_rollout_is_made() -> None:
    with pytest.raises(BadRollout, match="joint_vel"):
        replace(made(), joint_vel=np.zeros((7, 3)))
    with pytest.raises(BadRollout, match="joint_target"):
        replace(made(), joint_target=None)


def test_a_dataset_is_read_in_name_order_with_its_model(tmp_path: Path) -> None:
    for name in ("b", "a"):
        write_rollout(tmp_path / "rollouts" / f"{name}.parquet", made(name))
    assert read_dataset(tmp_path).model_path is None
    (tmp_path / "model.xml").write_text("<mujoco/>")
    dataset = read_dataset(tmp_path)
    assert [rollout.rollout_id for rollout in dataset.rollouts] == ["a", "b"]
    assert dataset.model_path == tmp_path / "model.xml"


def test_an_empty_dataset_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="rollouts"):
        read_dataset(tmp_path)
    (tmp_path / "rollouts").mkdir()
    with pytest.raises(BadInput, match="none"):
        read_dataset(tmp_path)
