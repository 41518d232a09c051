"""The study's table 1: all methods have equal steps, each is run in its own manner, also on sealed robots."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.study.jobs import DONE, MORE_GENERALISTS, OTHERS, Job, arm_of, job_of, table_1_jobs, teacher_of
from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.others import manner, students_task, teachers_task
from benchmarks.study.pages.table_1 import STUDENTS, table_1_tables
from benchmarks.study.sealed_trials import follow_sealed, sealed_files, try_sealed
from benchmarks.study.settings import SMALL
from benchmarks.study.training import train
from benchmarks.study.trying import SEALED_TRIALS, TRIALS, write_trials
from bumblebee.errors import BadInput
from bumblebee.learning.policy import load_policy
from bumblebee.stand_in.process import BASES
from bumblebee.stand_in.sealed import entry
from bumblebee.stand_in.undeclared.faults import largest
from bumblebee.stand_in.undeclared.kinds import KINDS
from tasks.seal import drawn_place
from tests.benchmarks.study.study_folder import fill


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Motions, a sealed robot without effects, and a run with HOVER's teacher and student."""
    folder = tmp_path_factory.mktemp("table-1")
    fill(folder)
    jobs = {job.name: job for job in table_1_jobs(SMALL, read_motions(folder))}
    teacher, student = jobs[teacher_of(0, "hover")], jobs[arm_of(0, "hover")]
    assert train(replace(teacher, steps=400.0), read_motions(folder), SMALL, folder / "run")
    assert train(student, read_motions(folder), SMALL, folder / "run")
    return folder


@pytest.fixture(scope="module")
def motions(folder: Path) -> Motions:
    return read_motions(folder)


def test_every_method_has_the_same_steps_and_motions(motions: Motions) -> None:
    jobs = {job.name: job for job in table_1_jobs(SMALL, motions)}

    def all_steps(job: Job) -> float:
        """Steps of the job and everything that it comes from."""
        needed, wanted = set(), [job.name]
        while wanted:
            name = wanted.pop()
            needed.add(name)
            wanted += [*jobs[name].experts, *filter(None, [jobs[name].parent])]
        return sum(jobs[name].steps for name in needed)

    steps = {arm: all_steps(jobs[arm_of(0, arm)]) for arm in STUDENTS}
    assert set(steps.values()) == {SMALL.base_steps + 2 * SMALL.expert_steps + SMALL.distil.frames}
    assert set(steps) == {"transformer", *MORE_GENERALISTS, *OTHERS}
    assert all(jobs[teacher_of(0, name)].clips is jobs[arm_of(0, name)].clips is None for name in OTHERS)


def test_others_learn_on_the_studys_robots_and_their_students_from_an_exact_teacher() -> None:
    for name in OTHERS:
        teacher, student = teachers_task(SMALL, name).env, students_task(SMALL, name).env
        assert teacher.randomisation == student.randomisation == SMALL.env.randomisation
        assert not teacher.student.terms and student.student.terms
        assert (student.observation.noise, student.num_worlds) == (0.0, SMALL.distil.worlds)


def test_a_student_is_distilled_and_both_are_tried_in_their_own_manner(folder: Path, motions: Motions) -> None:
    run = folder / "run"
    made = run / arm_of(0, "hover")
    assert "loss" in json.loads((made / DONE).read_text()) and job_of(made).arm == "hover"
    how = manner(job_of(made), load_policy(made))
    assert "hover_command_all" in how.seen.now and how.scale == 0.25  # all of the command, nothing masked
    assert manner(job_of(run / teacher_of(0, "hover")), load_policy(made)).seen.history == 1
    for name in (made.name, teacher_of(0, "hover")):
        write_trials(run / name, motions)
        assert len(pd.read_csv(run / name / TRIALS)) == 2 * len(motions.rows)


def test_a_student_that_was_cut_off_goes_on(folder: Path, motions: Motions, tmp_path: Path) -> None:
    job = next(job for job in table_1_jobs(SMALL, motions) if job.name == arm_of(0, "hover"))
    (tmp_path / teacher_of(0, "hover")).symlink_to(folder / "run" / teacher_of(0, "hover"))
    asked = iter([False, False, True])
    assert not train(job, motions, SMALL, tmp_path, over=lambda: next(asked))
    assert (tmp_path / job.name / "student.pt").exists() and not (tmp_path / job.name / DONE).exists()
    assert train(job, motions, SMALL, tmp_path)
    frames = pd.read_csv(tmp_path / job.name / "student.csv")["frames"]
    assert frames.is_monotonic_increasing and frames.iloc[-1] == SMALL.distil.frames


def test_a_policy_sees_readings_and_is_judged_by_the_truth(folder: Path, motions: Motions) -> None:
    """A drive that follows an encoder which is off holds its joint as far off, though the reading is as without."""
    made = folder / "run" / arm_of(0, "hover")
    policy, clips = load_policy(made), [row.clip for row in motions.rows[:2]]
    how, seen = manner(job_of(made), policy), {}
    kind, place = KINDS["encoder_offset"], drawn_place("left_elbow_joint", np.random.default_rng(0))
    off = entry(kind, place, 0.5 * largest(kind, place))
    for name, effects in {"none": [], "again": [], "off": [off]}.items():
        seen[name] = follow_sealed(policy, how, clips, effects, BASES[0])
    pd.testing.assert_frame_equal(seen["none"], seen["again"])
    assert list(seen["none"]["name"]) == [clip.name for clip in clips]
    away = seen["off"]["mpjpe_rad"] - seen["none"]["mpjpe_rad"]
    assert away.abs().to_numpy() == pytest.approx(0.5 * largest(kind, place) / 23, rel=0.2)  # of 23 joints' mean


def test_a_finished_policy_is_tried_on_every_sealed_robot(folder: Path, motions: Motions) -> None:
    made, robots = folder / "run" / arm_of(0, "hover"), folder / "robots"
    (robots / "robot-0.json").write_text((robots / "declared.json").read_text())
    try_sealed(made, motions, robots)
    rows = pd.read_csv(made / SEALED_TRIALS)
    one, other = (rows[rows["robot"] == name].drop(columns="robot") for name in ("declared", "robot-0"))
    assert len(one) == len(motions.rows) and one.reset_index(drop=True).equals(other.reset_index(drop=True))


def test_without_sealed_robots_one_line_says_what_to_run(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"expected declared\.json and sealed robots.*benchmarks\.study\.robots"):
        sealed_files(tmp_path)


def test_the_tables_have_a_row_for_each_method_and_pair_ours_with_every_other(motions: Motions, tmp_path: Path) -> None:
    names = {arm_of(0, arm): 1.0 if arm == "transformer" else 0.0 for arm in STUDENTS}
    names |= dict.fromkeys((teacher_of(0, name) for name in OTHERS), 1.0)
    labels = motions.labels
    for name, success in names.items():
        rows = pd.DataFrame({"name": labels["name"], "split": labels["split"], "success": success})
        rows = rows.assign(success_local=success, success_upright=success, mpjpe_rad=0.1, mpkpe_mm=50.0)
        rows = rows.assign(mpkpe_local_mm=40.0)
        (tmp_path / name).mkdir()
        pd.concat([rows.assign(robot=r) for r in ("declared", "drawn")]).to_csv(tmp_path / name / TRIALS)
        if "teacher" not in name:
            sealed = [rows.assign(robot=r, sealed="abc") for r in ("declared", "robot-0")]
            pd.concat(sealed).to_csv(tmp_path / name / SEALED_TRIALS)
    text = table_1_tables(tmp_path, SMALL, motions)
    assert "| HOVER's teacher, which sees the simulator | trained | 4 | 1.00" in text
    assert text.count("| OmniH2O | held out | +1.000") == 5  # four robots, and all sealed ones
    assert "### from readings: robot-0 robot" in text
    for name in (arm_of(0, "random"), teacher_of(0, "exbody2")):
        (tmp_path / name / TRIALS).unlink()
    fewer = table_1_tables(tmp_path, SMALL, motions).split("### from readings")[0]
    assert "Random" not in fewer and "Exbody2's teacher" not in fewer and "| Exbody2 |" in fewer
    (tmp_path / arm_of(0, "transformer") / TRIALS).unlink()
    with pytest.raises(BadInput, match="the trials of every policy"):
        table_1_tables(tmp_path, SMALL, motions)
