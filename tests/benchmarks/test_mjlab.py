"""Beside mjlab: what was followed against time as a file, and as the table of a page."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.mjlab.__main__ import BEGIN, END, followed, motions, parse, run, table
from benchmarks.mjlab.record import CURVE, FOLLOWED, compiling, write_followed
from benchmarks.motion_pack import Packed, read_pack, write_pack
from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.learning.policy import load_policy
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.robot.facts import joint_names

CLIPS = make_library(EmbeddedConfig(limit=2))


def a_run(folder: Path, learner: str, until: int = 3) -> Path:
    """Thirty iterations of 2 s, the first of which took 62 s, and a motion more followed after each 20 s."""
    folder.mkdir()
    seconds = 60 + 2 * np.arange(1, 31)
    pd.DataFrame({"frames": np.arange(1, 31) * 1e6, "seconds": seconds}).to_csv(folder / CURVE)
    marks = {80.0: 90.0, 100.0: 110.0, 120.0: 130.0}
    tried = {
        mark: {name: (i <= n and i < until, 0.5 + 0.5 * (i <= n and i < until)) for i, name in enumerate("abc")}
        for n, mark in enumerate(marks)
    }
    write_followed(folder, learner, marks, tried)
    return folder


def test_compiling_is_what_the_first_iterations_took_longer_than_others():
    assert compiling(60 + 2.0 * np.arange(1, 31)) == pytest.approx(60.0)
    assert compiling(2.0 * np.arange(1, 31)) == compiling(np.array([9.0, 10.0])) == 0.0


def test_each_actor_has_its_time_with_and_without_compiling_and_the_steps_it_had_seen(tmp_path: Path):
    rows = pd.read_csv(a_run(tmp_path / "x", "x") / FOLLOWED)
    first = rows.groupby("trained_s").first()
    assert list(first.index) == [20.0, 40.0, 60.0] and list(first["with_start_s"]) == [90.0, 110.0, 130.0]
    assert list(first["frames"]) == [10e6, 20e6, 30e6]
    assert list(rows.groupby("trained_s")["followed"].sum()) == [1, 2, 3]


def test_the_table_says_when_half_and_all_were_first_followed_and_replaces_the_one_before(tmp_path: Path):
    page, runs = tmp_path / "page.md", [a_run(tmp_path / "a", "a"), a_run(tmp_path / "b", "b", until=1)]
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    for _ in range(2):
        assert run(parse(["table", *map(str, runs), "--out", str(page)])) == 0
    text = page.read_text()
    assert text.startswith(f"before\n{BEGIN}\n") and text.endswith(f"{END}\nafter\n") and "old" not in text
    a, b = text.splitlines()[5:7]
    half, whole = (f"{t} min ({s} from its start), {n}.0 M steps" for t, s, n in ((0.7, 1.8, 20), (1.0, 2.2, 30)))
    assert a == f"| a | {half} | {whole} | 3 of 3, 1.00 of their frames: {whole} |"
    assert b == f"| b | not reached | not reached | 1 of 3, 0.67 of their frames: {whole} |"


def test_actors_that_were_kept_while_compiling_are_counted_apart(tmp_path: Path):
    folder = a_run(tmp_path / "a", "a")
    marks = {61.0: 70.0, 62.0: 71.0}
    write_followed(folder, "a", marks, {mark: {"walk": (True, 1.0)} for mark in marks})
    assert "1 of 1, 1.00 of their frames" in table([folder])


def test_a_page_without_the_mark_and_a_run_without_its_file_are_one_line(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text("none")
    with pytest.raises(BadInput, match=f"expected a line {BEGIN}"):
        run(parse(["table", str(a_run(tmp_path / "a", "a")), "--out", str(page)]))
    with pytest.raises(BadInput, match=f"{FOLLOWED}: expected a run of this benchmark"):
        run(parse(["table", str(tmp_path), "--out", str(page)]))


def test_both_sides_learn_from_one_file_and_a_motion_that_is_not_there_is_named(tmp_path: Path):
    rows = [Packed("real", True, replace(clip, split="test")) for clip in CLIPS]
    write_pack(tmp_path / "all.npz", rows)
    name = CLIPS[1].name
    motions(tmp_path / "all.npz", tmp_path / "one.npz", (name,))
    assert [(row.clip.name, row.clip.split) for row in read_pack(tmp_path / "one.npz")] == [(name, "train")]
    with np.load(tmp_path / "one.npz") as file:
        assert file["joint_names"].tolist() == list(joint_names()) and file["fps"] == 50.0
    with pytest.raises(BadInput, match=f"motions: expected {name}, gone, came no gone"):
        motions(tmp_path / "all.npz", tmp_path / "two.npz", (name, "gone"))


def test_a_motion_counts_as_followed_if_all_of_it_was():
    found = followed(load_policy(pretrained.FOLDER), CLIPS)
    assert set(found) == {clip.name for clip in CLIPS}
    assert all(0.0 < share <= 1.0 and (share == 1.0) == kept for kept, share in found.values())
