"""The study's generalists: distilled of a run's policies, gone on with after a stop, judged against the experts."""

import json
from pathlib import Path

import pandas as pd
import pytest

from benchmarks.study.__main__ import chosen, main, needs_of, of_seeds
from benchmarks.study.distilling import CURVE
from benchmarks.study.jobs import DONE, GENERALISTS, arm_of, experts_jobs, generalist_jobs
from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.pages.generalist_tables import generalist_tables, verdict
from benchmarks.study.settings import SMALL, Study
from benchmarks.study.training import train
from benchmarks.study.trying import TRIALS
from bumblebee.errors import BadInput
from bumblebee.evaluation.intervals import Estimate
from bumblebee.learning.policy import Policy, load_policy, new_actor, shape_of
from tests.benchmarks.study.study_folder import fill
from tests.learning.tiny import env_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Motions, and a run whose base policy and experts were not trained."""
    folder = tmp_path_factory.mktemp("generalist")
    fill(folder)
    shape = shape_of(env_of(SMALL.env), (16,))
    for name in ("s0-base", "s0-c0", "s0-c1"):
        (folder / "run" / name).mkdir(parents=True)
        Policy(new_actor(shape), {}, shape).save(folder / "run" / name)
    return folder


@pytest.fixture(scope="module")
def motions(folder: Path) -> Motions:
    return read_motions(folder)


def test_a_generalist_waits_for_its_experts_and_the_general_init_for_the_base_alone(motions: Motions) -> None:
    jobs = {job.name: job for job in generalist_jobs(SMALL, motions)}
    assert needs_of(jobs["s0-transformer"]) == ("s0-base", "s0-c0", "s0-c1")
    assert needs_of(jobs["s0-init"]) == ("s0-base",)
    assert {arm_of(0, arm) for arm in GENERALISTS} < set(jobs)
    same = {job.name: job for job in experts_jobs(SMALL, motions)}
    assert all(jobs[name] == same[name] for name in jobs if name in same)  # what the part `experts` trained is used


def test_jobs_are_chosen_with_what_they_need(motions: Motions) -> None:
    jobs = generalist_jobs(SMALL, motions)
    assert [job.name for job in chosen(jobs, ["s0-mlp"])] == ["s0-base", "s0-c0", "s0-c1", "s0-mlp"]
    assert chosen(jobs, None) == jobs
    with pytest.raises(BadInput, match=r"--only: expected some of s0-base.*came s0-none"):
        chosen(jobs, ["s0-none"])


def test_a_seed_that_the_study_has_not_is_refused() -> None:
    assert of_seeds(Study(), [2, 0]).seeds == (0, 2) and of_seeds(Study(), None).seeds == (0, 1, 2)
    with pytest.raises(BadInput, match="--seeds: expected some of 0, 1, 2, came 7"):
        of_seeds(Study(), [7])


@pytest.mark.parametrize("arm", ["transformer", "seeing"])
def test_a_run_is_distilled_and_one_cut_off_goes_on(folder: Path, motions: Motions, arm: str) -> None:
    job = next(job for job in generalist_jobs(SMALL, motions) if job.arm == arm)
    made = folder / "run" / job.name
    assert not train(job, motions, SMALL, folder / "run", over=lambda: True) and not (made / DONE).exists()
    assert train(job, motions, SMALL, folder / "run")
    curve = pd.read_csv(made / CURVE)
    assert list(curve["iteration"]) == [1, 2, 3] and curve["frames"].iloc[-1] == SMALL.distil.frames
    assert json.loads((made / DONE).read_text())["kl"] == pytest.approx(curve["kl"].iloc[-1], abs=1e-4)
    assert (load_policy(made).shape.memory is None) == (arm == "seeing")


def test_an_expert_that_the_run_has_not_is_named(folder: Path, motions: Motions, tmp_path: Path) -> None:
    job = next(job for job in generalist_jobs(SMALL, motions) if job.arm == "mlp")
    with pytest.raises(BadInput, match=r"s0-c0/policy\.pt: expected a trained policy, came no file"):
        train(job, motions, SMALL, tmp_path)


def test_the_margin_is_kept_lost_or_open() -> None:
    kept, lost, unclear = ((-0.04, 0.02), (-0.2, -0.06), (-0.06, 0.02))
    assert [verdict(Estimate(0.0, *ends, 9, 9), 0.05) for ends in (kept, lost, unclear)] == ["kept", "lost", "open"]


def test_the_tables_pair_each_generalist_with_the_expert_of_the_motions_cluster(
    motions: Motions, tmp_path: Path
) -> None:
    """The expert of c1 follows only what is in its cluster; taken for all motions it would lose the others."""
    cluster = motions.labels.set_index("name")["cluster"]
    for job in generalist_jobs(SMALL, motions):
        follows = cluster == job.name.removeprefix("s0-") if job.clips else cluster == "c0"
        rows = pd.DataFrame({"name": cluster.index, "split": motions.labels["split"].to_numpy()})
        rows = rows.assign(success=follows.to_numpy(), mpjpe_rad=0.1, mpkpe_mm=50.0)
        rows = rows.assign(success_local=rows["success"], success_upright=rows["success"])
        (tmp_path / job.name).mkdir()
        (tmp_path / job.name / DONE).write_text(json.dumps({"kl": 1.5}))
        pd.concat([rows.assign(robot=r) for r in ("declared", "drawn")]).to_csv(tmp_path / job.name / TRIALS)
    text = generalist_tables(tmp_path, SMALL, motions)
    assert "| experts, each on its cluster | trained | 4 | 1.00" in text
    assert "| transformer, of the experts | trained | 4 | 0.50" in text
    assert "| transformer, of the experts | 1.500 |" in text
    assert text.count("### ") == 3
    (tmp_path / "s0-mlp" / TRIALS).unlink()
    some = generalist_tables(tmp_path, SMALL, motions, ["transformer", "experts"])
    assert "| transformer, of the experts less experts, each on its cluster | trained |" in some
    assert "base policy" not in some and "MLP" not in some
    with pytest.raises(BadInput, match=r"--arms: expected some of base, .*, came one more"):
        generalist_tables(tmp_path, SMALL, motions, ["experts", "one more"])


def test_arms_are_the_generalists_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = [
        "table",
        "experts",
        str(tmp_path),
        "--arms",
        "one",
        "--motions",
        str(tmp_path),
        "--out",
        str(tmp_path / "x.md"),
    ]
    with pytest.raises(SystemExit):
        main(own)
    assert capsys.readouterr().out.startswith("--arms: expected the part generalist, came experts")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_part_runs_to_its_tables(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shared = ["--motions", str(folder), "--small"]
    main(["run", "generalist", *shared, "--out", str(tmp_path / "run"), "--gpus", "0"])
    assert capsys.readouterr().out.endswith("done\n")
    main(["table", "generalist", str(tmp_path / "run"), *shared, "--out", str(tmp_path / "g.md")])
    assert "within 0.05 of the experts" in (tmp_path / "g.md").read_text()
