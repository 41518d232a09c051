"""Motions, steps beside each other, settings that a run is held to, figures of tables."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from benchmarks.method.settings import SMALL
from benchmarks.motion_pack import Packed, write_pack
from benchmarks.study import motions as module
from benchmarks.study.__main__ import main
from benchmarks.study.motions import LABELS, MOTIONS, read_motions
from benchmarks.study.settings import freeze, frozen
from benchmarks.study.steps import GOES_ON, Places, Runner, Step, deadline, ready
from benchmarks.study.tables import cell, difference, rate
from bumblebee.clustering.config import ClusterConfig
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import Estimate
from bumblebee.motion.clip import Clip
from tests.benchmarks.study.study_folder import short_clips


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight short motions in two clusters, one of each held out."""
    folder = tmp_path_factory.mktemp("motions")
    clips = short_clips(8)
    splits = ["train", "train", "train", "test"] * 2
    rows = [Packed("made", True, replace(clip, split=split)) for clip, split in zip(clips, splits, strict=True)]
    write_pack(folder / MOTIONS, rows)
    clusters = ["c0"] * 4 + ["c1"] * 4
    table = {
        "name": [r.clip.name for r in rows],
        "motion": [r.clip.name for r in rows],
        "group": "made",
        "family": [r.clip.family for r in rows],
        "split": splits,
        "seconds": [r.clip.duration for r in rows],
        "cluster": clusters,
    }
    pd.DataFrame(table).to_csv(folder / LABELS, index=False)
    return folder


def test_a_step_waits_for_what_it_needs_and_for_its_kind_of_place() -> None:
    steps = [Step("b", (), Path("b"), gpu=True), Step("c", (), Path("c"), ("b",), gpu=True)]
    assert ready(steps, set(), {"b"}, True) is None
    assert ready(steps, {"b"}, {"b"}, False) is None
    assert ready(steps, {"b"}, {"b"}, True) == steps[1]
    assert ready(steps, {"b", "c"}, set(), True) is None


def test_a_call_is_over_after_its_seconds_and_without_any_never() -> None:
    assert deadline(-1.0)() and not deadline(60.0)() and not deadline(None)()


def test_nothing_held_out_is_learned_from_and_random_clusters_are_as_many_and_as_large(folder: Path) -> None:
    motions = read_motions(folder)
    train = motions.labels[motions.labels["split"] == "train"]
    assert [row.clip.name for row in motions.training()] == train["name"].tolist()
    random = motions.random_clusters(0)
    assert sorted(random.index) == sorted(motions.labels["name"]) and random.equals(motions.random_clusters(0))
    assert random[train["name"]].value_counts().to_dict() == {"r0": 3, "r1": 3}
    clips = [row.clip for row in motions.rows]
    assert motions.cluster_indices(clips) == [0] * 4 + [1] * 4
    assert motions.cluster_indices(clips, 0) == [int(random[clip.name][1:]) for clip in clips]


def test_motions_are_prepared_from_their_sources_and_what_cannot_be_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Reading and clustering have tests of their own; here they are made up."""
    clips = [replace(clip, family="some") for clip in short_clips(10)]
    monkeypatch.setattr(module, "read_folder", lambda source, config: SimpleNamespace(clips=clips))
    monkeypatch.setattr("bumblebee.clustering.pipeline.cluster_clips", clustered)
    given = ["--out", str(tmp_path / "motions")]
    main(["prepare", "people.zip", *given])
    told = capsys.readouterr().out
    motions = read_motions(tmp_path / "motions")
    assert motions.clusters == ["c0", "c1"] and set(motions.labels["group"]) == {"people"}
    held = round(0.22 * len(motions.rows))
    assert motions.labels["split"].value_counts().to_dict() == {"train": len(motions.rows) - held, "test": held}
    assert "c1: waits; 3 pieces, 1 held out, 0.10 m/s" in told and f"test {held}" in " ".join(told.split())
    with pytest.raises(SystemExit) as end:
        main(["prepare", "people.zip", "again.zip", *given])
    assert end.value.code == 2
    assert "sources: expected motions of different names, came" in capsys.readouterr().out
    pd.read_csv(tmp_path / "motions" / LABELS)[1:].to_csv(tmp_path / "motions" / LABELS, index=False)
    with pytest.raises(BadInput, match="a row for each piece"):
        read_motions(tmp_path / "motions")


def clustered(clips: Sequence[Clip], names: Sequence[str], config: ClusterConfig) -> SimpleNamespace:
    """Clips in clusters by turns, and an elbow at two."""
    labels = pd.DataFrame({"name": [clip.name for clip in clips]})
    one = {"label": "waits", "clips": 3, "held_out_clips": 1, "speed": 0.1}
    summary = {"elbow": {"suggested_k": 2}, "clusters": dict.fromkeys(names, one)}
    labels["cluster"] = [names[i % len(names)] for i in range(len(clips))]
    return SimpleNamespace(labels=labels, elbow=pd.DataFrame({"k": [2]}), summary=summary)


def test_a_cluster_of_one_motion_is_refused(folder: Path, tmp_path: Path) -> None:
    labels = pd.read_csv(folder / LABELS)
    labels.loc[labels.index[0], "cluster"] = "c2"
    labels.to_csv(tmp_path / LABELS, index=False)
    (tmp_path / MOTIONS).write_bytes((folder / MOTIONS).read_bytes())
    with pytest.raises(BadInput, match="cluster c2: expected at least 2 motions to learn from, came 1"):
        read_motions(tmp_path)


def test_a_difference_is_paired_by_piece_and_its_interval_is_over_motions() -> None:
    names = [f"m{i}" for i in range(20)]
    rows = [
        {
            "arm": arm,
            "seed": seed,
            "robot": "declared",
            "name": f"{n}_p{piece}",
            "motion": n,
            "success": arm == "experts",
        }
        for arm in ("experts", "one")
        for seed in (0, 1)
        for n in names
        for piece in (0, 1)
    ]
    table = pd.DataFrame(rows)
    harder = table["name"].isin([f"{n}_p0" for n in names[:10]])
    table.loc[harder, "success"] = False
    value, p = difference(table.sample(frac=1, random_state=0), "experts", "one")
    assert value.value == pytest.approx(0.75)
    assert value.motions == 20
    assert 0.6 < value.low < 0.75 < value.high < 0.9
    assert p < 0.001


def test_a_rate_of_none_has_an_interval_and_pieces_and_seeds_of_a_motion_are_no_more_than_it() -> None:
    names = [f"m{i}" for i in range(10)]
    none = rate(pd.DataFrame({"motion": names, "success": False}), "success")
    assert (none.value, none.low) == (0.0, 0.0)
    assert 0.2 < none.high < 0.35
    half = pd.DataFrame({"motion": names, "success": [True] * 5 + [False] * 5})
    once, often = rate(half, "success"), rate(pd.concat([half] * 6), "success")
    assert once.value == often.value == 0.5
    assert (once.low, once.high) == pytest.approx((often.low, often.high))
    assert cell(Estimate(0.5, float("nan"), float("nan"), 1, 1), 2) == "0.50"
    assert cell(Estimate(float("nan"), 0.0, 0.0, 0, 0), 2) == "-"


def _print(path: Path, code: int) -> str:
    """A module that writes its place and arguments and leaves with this exit code."""
    path.write_text(
        f"import os, sys\nprint(repr(os.environ['CUDA_VISIBLE_DEVICES']), *sys.argv[1:2])\nsys.exit({code})\n"
    )
    return path.stem


@pytest.mark.parametrize("code", [0, 1, GOES_ON])
def test_steps_are_all_done_stop_at_a_failure_and_wait_for_another_call_when_the_time_is_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    good, other = _print(tmp_path / "study_good.py", 0), _print(tmp_path / "study_other.py", code)
    done = tmp_path / "done"
    done.write_text("")
    steps = [
        Step("known", ("no_such_module",), done),
        Step("base", (good,), tmp_path / "b", ("known",), gpu=True),
        Step("trial", (good,), tmp_path / "t", ("base",)),
        Step("other", (other,), tmp_path / "o", ("trial",), gpu=True),
        Step("after", (good,), tmp_path / "a", ("other",)),
    ]
    runner = Runner(steps, Places(2, 1, 1), tmp_path / "l", 60.0)
    assert runner.run() is (code == 0)
    assert runner.failed == (["other"] if code == 1 else [])
    assert (tmp_path / "l" / "base.log").read_text().strip() in ("'0' --seconds", "'1' --seconds")
    assert (tmp_path / "l" / "trial.log").read_text().strip() == "''"
    assert (tmp_path / "l" / "after.log").exists() is (code == 0)


def test_the_frozen_file_is_plain(tmp_path: Path) -> None:
    first = freeze(tmp_path, SMALL, motions="x")
    assert first == freeze(tmp_path, SMALL, motions="x")
    stated = json.loads((tmp_path / "study.json").read_text())
    assert stated == frozen(tmp_path) and stated["study"]["base"]["hidden"] == [32, 32]
    assert np.isclose(stated["study"]["env"]["randomisation"]["delay"][1], 0.04)


def test_a_run_goes_on_with_its_own_settings_alone_and_a_folder_without_one_is_one_line(tmp_path: Path) -> None:
    freeze(tmp_path / "run", replace(SMALL, expert=7), motions="x")
    with pytest.raises(BadInput, match=r"others: study\.expert 7"):
        freeze(tmp_path / "run", SMALL, motions="x")
    with pytest.raises(BadInput, match="the settings of a run, came no such file"):
        frozen(tmp_path)


def test_a_run_goes_on_with_settings_that_later_code_added(tmp_path: Path) -> None:
    stamp = freeze(tmp_path, SMALL, motions="x")
    began = json.loads((tmp_path / "study.json").read_text())
    del began["study"]["env"]["sampler_floor"]
    (tmp_path / "study.json").write_text(json.dumps(began))
    later = freeze(tmp_path, SMALL, motions="x")
    assert later != stamp
    with pytest.raises(BadInput, match="motions"):
        freeze(tmp_path, SMALL, motions="y")
