"""The study: a run is held to its settings, goes on where it was ended, and its tables pair what belongs together."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.motion_pack import Packed, write_pack
from benchmarks.study.__main__ import main
from benchmarks.study.jobs import (
    PAPER_ARMS,
    PAPER_LONGER,
    SURVIVORS,
    base_of,
    even_of,
    experts_jobs,
    one_of,
    paper_jobs,
    robust_jobs,
)
from benchmarks.study.motions import LABELS, MOTIONS, read_motions
from benchmarks.study.pages.paper_tables import paper_tables
from benchmarks.study.pages.robust_tables import robust_tables
from benchmarks.study.pages.tables import difference, experts_tables, rate
from benchmarks.study.settings import PAPER_CHANGES, ROBUST_CHANGES, SMALL, Study, freeze, settings_of
from benchmarks.study.steps import GOES_ON, Places, Runner, Step, ready
from benchmarks.study.training import finished, train
from benchmarks.study.trying import write_trials
from bumblebee.errors import BadInput
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


def test_the_one_policy_gets_the_steps_of_all_experts_and_random_clusters_are_as_many(folder: Path) -> None:
    motions = read_motions(folder)
    jobs = {job.name: job for job in experts_jobs(SMALL, motions)}
    experts = [job for name, job in jobs.items() if name.startswith("s0-c")]
    others = [job for name, job in jobs.items() if name.startswith("s0-r")]
    assert len(experts) == len(others) == 2
    assert jobs[even_of(0)].even
    assert (
        jobs[one_of(0)].steps
        == jobs[even_of(0)].steps
        == sum(job.steps for job in experts)
        == sum(job.steps for job in others)
    )
    for group in (experts, others):
        assert sorted(name for job in group for name in job.clips or ()) == sorted(motions.labels["name"])


def test_nothing_held_out_is_learned_from(folder: Path) -> None:
    motions = read_motions(folder)
    held = set(motions.labels[motions.labels["split"] == "test"]["name"])
    for job in experts_jobs(SMALL, motions):
        learned = {row.clip.name for row in motions.training(job.clips)}
        assert learned
        assert not learned & held


def test_a_step_waits_for_what_it_needs_for_its_kind_of_place_and_for_its_time() -> None:
    steps = [Step("b", (), Path("b"), gpu=True), Step("c", (), Path("c"), ("b",), gpu=True, seconds=60.0)]
    assert ready(steps, set(), {"b"}, True, None) is None
    assert ready(steps, {"b"}, {"b"}, False, None) is None
    assert ready(steps, {"b"}, {"b"}, True, 59.0) is None
    assert ready(steps, {"b"}, {"b"}, True, 60.0) == ready(steps, {"b"}, {"b"}, True, None) == steps[1]
    assert ready(steps, {"b", "c"}, set(), True, None) is None


def test_a_run_is_trained_ended_gone_on_with_and_made_into_tables(folder: Path, tmp_path: Path) -> None:
    motions, out = read_motions(folder), tmp_path / "run"
    freeze(out, SMALL, motions=motions.hash)
    jobs = experts_jobs(SMALL, motions)
    assert not train(jobs[0], motions, SMALL, out, over=lambda: True)
    assert not finished(out, jobs[0])
    for job in jobs:
        assert train(job, motions, SMALL, out)
        assert finished(out, job)
        write_trials(out / job.name, motions)
    with pytest.raises(BadInput, match="another training"):
        finished(out, replace(jobs[0], steps=1.0))
    text = experts_tables(out, SMALL, motions)
    assert "experts by cluster | held out | 2 |" in text
    assert text.count("experts by cluster less one policy, the experts' steps") == 4
    assert text.count("the same, each cluster drawn as often less one policy") == 4
    shutil.rmtree(out / even_of(0))
    assert "drawn as often" not in experts_tables(out, SMALL, motions)
    text = experts_tables(out, SMALL, motions)
    main(
        [
            "table",
            "experts",
            str(out),
            "--motions",
            str(folder),
            "--small",
            "--out",
            str(tmp_path / "t.md"),
            "--curves",
            str(tmp_path / "c.svg"),
        ]
    )
    assert text in (tmp_path / "t.md").read_text()
    assert "</svg>" in (tmp_path / "c.svg").read_text()


def test_a_run_goes_on_with_its_own_settings_alone(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    freeze(tmp_path, replace(SMALL, expert_steps=7.0), motions=read_motions(folder).hash)
    with pytest.raises(SystemExit) as end:
        main(["run", "experts", "--small", "--motions", str(folder), "--out", str(tmp_path)])
    assert end.value.code == 2
    assert "study.expert_steps" in capsys.readouterr().out


def test_a_gpu_that_is_not_there_is_said_before_anything_is_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("torch.cuda.device_count", lambda: 0)
    with pytest.raises(SystemExit) as end:
        main(["run", "experts", "--motions", str(folder), "--out", str(tmp_path / "new"), "--gpus", "2"])
    assert end.value.code == 2
    assert "--gpus: expected a machine with a GPU, came 2" in capsys.readouterr().out
    assert not (tmp_path / "new").exists()


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
    assert stated["study"]["seeds"] == [0]
    assert np.isclose(stated["study"]["env"]["randomisation"]["delay"][1], 0.04)
    assert base_of(0) == "s0-base"


def test_each_arm_of_the_papers_task_differs_by_what_it_says_and_is_tried(folder: Path, tmp_path: Path) -> None:
    assert list(PAPER_ARMS) == list(PAPER_CHANGES)
    settings = {arm: settings_of(Study(), f"paper-{arm}", False) for arm in PAPER_ARMS}
    printed_env, printed_ppo = settings["printed"]
    assert printed_ppo.initial_std == 1.0
    assert settings["std"] == (printed_env, replace(printed_ppo, initial_std=0.2))
    assert len({repr(own) for own in settings.values()}) == len(PAPER_ARMS)
    motions = read_motions(folder)
    jobs = paper_jobs(SMALL, motions)
    longer = [job for job in jobs if job.steps == SMALL.base_steps]
    assert [job.settings for job in longer] == [f"paper-{arm}" for arm in PAPER_LONGER]
    for job in jobs:
        if job.settings in ("paper-printed", "paper-floor"):
            assert train(job, motions, SMALL, tmp_path)
            write_trials(tmp_path / job.name, motions)
    assert len({job.name for job in jobs if finished(tmp_path, job)}) == 2
    with pytest.raises(BadInput, match="trials of every policy"):
        paper_tables(tmp_path / "none", SMALL, motions)
    assert len(paper_tables(tmp_path, SMALL, motions).splitlines()) == 2 + 2 * 2
    for job in jobs:
        if not (tmp_path / job.name).exists():
            shutil.copytree(tmp_path / jobs[0].name, tmp_path / job.name)
    lines = paper_tables(tmp_path, SMALL, motions).splitlines()
    assert len(lines) == 2 + 2 * (len(PAPER_ARMS) + len(PAPER_LONGER))
    assert lines[2].startswith("| as printed | trained | 6 | ")


def test_a_run_goes_on_with_settings_that_later_code_added(tmp_path: Path) -> None:
    stamp = freeze(tmp_path, SMALL, motions="x")
    began = json.loads((tmp_path / "study.json").read_text())
    del began["study"]["ppo"]["captured"]
    (tmp_path / "study.json").write_text(json.dumps(began))
    later = freeze(tmp_path, SMALL, motions="x")
    assert later != stamp
    with pytest.raises(BadInput, match="motions"):
        freeze(tmp_path, SMALL, motions="y")


def test_each_change_of_the_task_differs_by_what_it_says_and_is_held_against_the_base_policy(
    folder: Path, tmp_path: Path
) -> None:
    assert set(SURVIVORS) == set(ROBUST_CHANGES)
    base, ppo = settings_of(Study(), "ours", False)
    settings = {arm: settings_of(Study(), f"robust-{arm}", False) for arm in SURVIVORS}
    assert {own for _, own in settings.values()} == {ppo}
    assert settings["judged"][0] == replace(base, place="own")
    assert settings["loose"][0] == replace(base, threshold_end=0.8)
    assert settings["history"][0].observation.history == 10
    assert settings["place-history"][0].observation.now == ("demo_in_place",)
    assert len({repr(own) for own, _ in settings.values()}) == len(SURVIVORS)
    motions = read_motions(folder)
    study = replace(SMALL, base_steps=512)
    jobs = {job.name: job for job in robust_jobs(study, motions)}
    tried = [jobs[name] for name in ("s0-base", "s0-place-history")]
    for job in tried:
        assert train(job, motions, study, tmp_path)
        write_trials(tmp_path / job.name, motions)
    text = robust_tables(tmp_path, study, motions)
    assert "| own place, seeing it alone, ten steps | held out | 2 | " in text
    assert "all sealed robots" not in text
    for job in tried:
        rows = pd.read_csv(tmp_path / job.name / "trials.csv").assign(sealed="x")
        rows.to_csv(tmp_path / job.name / "sealed.csv", index=False)
    assert "all sealed robots" in robust_tables(tmp_path, study, motions)
