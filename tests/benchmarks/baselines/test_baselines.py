"""Packed motions, methods by name, settings by path, and a training of a second that ends and goes on."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from benchmarks.baselines import table as tables
from benchmarks.baselines.__main__ import RESUME, SETTINGS, parse, run, training_clips
from benchmarks.baselines.methods import METHODS, changed, method, require_kept
from benchmarks.baselines.trial import RESULTS, TABLE, TRIALS, summary, table_of
from benchmarks.motion_pack import Packed, read_pack, whole_motions, write_pack
from bumblebee.errors import BadInput
from bumblebee.learning.policy import load_policy
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.motion.pieces import split_long

CLIPS = make_library(EmbeddedConfig(limit=3))


def pieces(name: str, group: str = "real", dropped: int | None = None, split: str = "train") -> list[Packed]:
    """A motion in pieces of about 3 s; the filter dropped one of them, if any."""
    cut = split_long(replace(CLIPS[0], name=name, split=split), 3.0)
    return [Packed(group, i != dropped, clip) for i, clip in enumerate(cut)]


def test_a_pack_comes_back_as_it_was(tmp_path: Path):
    rows = pieces("a", dropped=1) + pieces("b", split="test")
    write_pack(tmp_path / "m.npz", rows)
    again = read_pack(tmp_path / "m.npz")
    assert [(r.group, r.kept, r.clip.name, r.clip.split, r.clip.family) for r in again] == [
        (r.group, r.kept, r.clip.name, r.clip.split, r.clip.family) for r in rows
    ]
    for old, new in zip(rows, again, strict=True):
        assert np.allclose(old.clip.joint_pos, new.clip.joint_pos) and np.allclose(
            old.clip.key_pos, new.clip.key_pos, atol=1e-5
        )


@pytest.mark.parametrize("content", [None, b"no archive"])
def test_what_is_no_pack_is_one_line(tmp_path: Path, content: bytes | None):
    path = tmp_path / "m.npz"
    if content:
        path.write_bytes(content)
    with pytest.raises(BadInput, match=r"expected a file of benchmarks.motion_pack"):
        read_pack(path)


def test_whole_motions_are_their_pieces_in_order_and_those_with_a_gap_are_left_out():
    rows = pieces("whole") + pieces("gap", dropped=0)
    joined = whole_motions(list(reversed(rows)))
    assert [row.clip.name for row in joined] == ["whole"]
    assert np.array_equal(joined[0].clip.joint_pos, CLIPS[0].joint_pos)


def test_training_takes_whole_motions_the_pieces_beside_gaps_and_nothing_held_out():
    rows = pieces("whole") + pieces("gap", dropped=0) + pieces("held", split="test")
    assert [row.clip.name for row in training_clips(rows)] == ["whole", "gap_p1"]


@pytest.mark.parametrize("name", METHODS)
def test_every_method_has_settings_of_its_own(name: str):
    own = method(name)
    assert own.name == name and (own.student is None) == (name == "ours")
    assert own.tried.scale == (None if name in ("ours", "paper") else 0.25)


def test_settings_are_changed_by_path():
    own = changed(method("ours"), ["env.threshold_end=0.25", "ppo.hidden=[8, 8]", "env.randomisation.push=1"])
    own = changed(own, ["ppo.learning_rate_range=[1e-5, 2e-3]", "ppo.learning_rate=3e-4"])
    assert own.ppo.learning_rate_range == (1e-5, 2e-3) and own.ppo.learning_rate == 3e-4
    assert own.env.threshold_end == 0.25 and own.ppo.hidden == (8, 8) and own.env.randomisation.push == 1.0
    with pytest.raises(BadInput, match=r"--set env.thresold=1: expected engine or .*, came thresold"):
        changed(own, ["env.thresold=1"])
    with pytest.raises(BadInput, match="came deeper"):
        changed(own, ["ppo.entropy.deeper=1"])


def test_the_table_counts_motions_and_not_pieces():
    rows = [("a_p0", True), ("a_p1", True), ("b", False)]
    table = pd.DataFrame(rows, columns=["name", "success"]).assign(
        policy="x",
        kind="pieces",
        group="asap",
        split="train",
        success_local=True,
        success_upright=True,
        mpjpe_rad=0.1,
        mpkpe_mm=[10.0, 20.0, 60.0],
    )
    table["mpkpe_local_mm"] = 5.0
    results = summary(table)
    assert [entry["group"] for entry in results] == ["asap", "real"]
    assert results[0]["n"] == 3 and results[0]["success"]["value"] == pytest.approx(2 / 3)
    assert results[0]["success"]["motions"] == 2 and results[0]["mpkpe_mm"]["value"] == pytest.approx((15 + 60) / 2)
    assert results[0]["mpkpe_mm_successful"]["value"] == 15.0
    assert "| x | asap, pieces | train | 3 | 0.67 [" in table_of(results)


def test_a_call_that_is_over_goes_on_to_the_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    write_pack(tmp_path / "m.npz", [Packed("real", True, clip) for clip in CLIPS[:2]])
    command = ["--method", "omnih2o", "--motions", str(tmp_path / "m.npz"), "--out", str(tmp_path / "out")]
    command += ["--engine", "mujoco", "--worlds", "4", "--threads", "1", "--jobs", "1", "--minutes", "0.05"]
    command += ["--variety", "1", "--keep-every", "0.5"]
    command += ["--set", "ppo.hidden=[8]", "ppo.steps=4", "student.hidden=[8]"]
    assert run(parse([*command, "--call-minutes", "0.025"])) == 0
    assert "the same command goes on" in capsys.readouterr().out
    first = torch.load(tmp_path / "out" / RESUME, weights_only=True)
    assert not (tmp_path / "out" / TABLE).exists()
    began = (tmp_path / "out" / SETTINGS).read_text()
    named = {name: json.loads(began)[name] for name in ("variety", "seed", "embedded", "std", "keep_every")}
    assert named == {"variety": 1, "seed": 0, "embedded": 1.0, "std": 0.0, "keep_every": 0.5}
    for other in (["--variety", "2"], ["--seed", "1"], ["--embedded", "2"]):
        with pytest.raises(BadInput, match=f"{SETTINGS}: {other[0][2:]}: expected .*, with which .*, came {other[1]}"):
            run(parse([*command, *other]))
        assert (tmp_path / "out" / SETTINGS).read_text() == began
    assert run(parse(command)) == 0
    assert "goes on after" in capsys.readouterr().out
    assert {load_policy(kept).shape.hidden for kept in (tmp_path / "out").glob("at-*s")} == {(8,)}
    last = torch.load(tmp_path / "out" / RESUME, weights_only=True)
    assert last["iteration"] > first["iteration"] > 0 and last["seconds"] >= 0.7 * 3.0
    trials = pd.read_csv(tmp_path / "out" / TRIALS)
    assert set(trials["policy"]) == {"teacher", "omnih2o"} and set(trials["name"]) == {c.name for c in CLIPS[:2]}
    assert (tmp_path / "out" / RESULTS).exists() and (tmp_path / "out" / TABLE).exists()


def test_settings_that_an_older_run_did_not_write_may_be_anything_and_damaged_ones_are_one_line(tmp_path: Path):
    now = {"method": "ours", "variety": 2, "seed": 0, "embedded": 1.0}
    path = tmp_path / SETTINGS
    path.write_text(json.dumps({"method": "ours"}))
    require_kept(now, path)
    path.write_text("{")
    with pytest.raises(BadInput, match="expected the settings of a run, came JSONDecodeError"):
        require_kept(now, path)


def results(folder: Path, success: list[bool], mpkpe: list[float], method: str = "x") -> Path:
    """A folder as `benchmarks.baselines` leaves it, with a teacher who is not to count."""
    rows = pd.DataFrame({"name": list("abcdefgh"), "success": success, "mpkpe_mm": mpkpe})
    rows = rows.assign(policy=method, kind="whole", group="asap", split="train", success_local=True, mpjpe_rad=0.1)
    rows["mpkpe_local_mm"], rows["success_upright"] = 5.0, True
    folder.mkdir()
    pd.concat([rows, rows.assign(policy="teacher", success=False)]).to_csv(folder / TRIALS, index=False)
    (folder / "settings.json").write_text(json.dumps({"method": method}))
    return folder


def test_methods_are_compared_motion_by_motion(tmp_path: Path):
    first = results(tmp_path / "first", [True] * 8, [10.0] * 8)
    other = results(tmp_path / "other", [False] * 6 + [True] * 2, [30.0] * 8)
    entries = tables.compared([tables.read(f) for f in (first, other)], "first")
    assert [(e["policy"], e["success"]["value"]) for e in entries] == [("first", 1.0), ("other", 0.25)]
    # 6 motions that only the first follows: 2 / 2^6; of the 2 that both follow, all flips of two equal signs
    assert entries[1]["p_success"] == pytest.approx(2 / 64) and entries[1]["both"] == 2
    assert entries[1]["p_mpkpe"] == pytest.approx(0.5)
    text = tables.table_of(entries, "first")
    assert "| other | real | train | 8 | 0.25 [" in text and "0.031; MPKPE 0.500 (2)" in text


def test_what_cannot_be_compared_is_one_line(tmp_path: Path):
    first = results(tmp_path / "first", [True] * 8, [10.0] * 8)
    table = tables.read(first)
    with pytest.raises(BadInput, match="--against: expected first, came 'ours'"):
        tables.compared([table], "ours")
    with pytest.raises(BadInput, match="expected trials of the motions of first, came others"):
        tables.compared([table, table.iloc[:3].assign(policy="short")], "first")
    with pytest.raises(BadInput, match=r"expected results of benchmarks.baselines"):
        tables.read(tmp_path)
