"""The report's stage: the seal is the stand-in's truth and no other robot's; the film shows what was counted."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bumblebee.measured.rollout import Rollout, write_rollout
from bumblebee.measured.wire_note import wire_note
from bumblebee.report.films.film_choice import Choice
from bumblebee.report.films.filmstrip import Film
from bumblebee.report.results import RoundResults
from bumblebee.robot.facts import joint_names, stand_pose
from tasks import report
from tasks.pages import film
from tasks.running import paths
from tasks.sections import Loop, Round
from tests.report.made import loop_results


@pytest.mark.parametrize(("rollouts", "expected"), [("{}", {"effects": []}), ("{source: mine}", None)])
def test_the_seal_is_not_taken_for_the_truth_about_a_real_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rollouts: str, expected: dict | None
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("params.yaml").write_text(f"rollouts: {rollouts}\n")
    paths.SEALED_ROBOT.parent.mkdir(parents=True)
    paths.SEALED_ROBOT.write_text('{"effects": []}')
    assert report.sealed_truth() == expected


def test_the_wires_latency_is_among_what_the_declared_model_lacks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its median over the rollouts of all clusters, as they note it."""
    monkeypatch.chdir(tmp_path)
    Path("params.yaml").write_text("rollouts: {wire: lcm}\n")
    paths.SEALED_ROBOT.parent.mkdir(parents=True)
    paths.SEALED_ROBOT.write_text('{"effects": []}')
    shape = Loop(("c0", "c1"), (Round(1, 0),), 1)
    assert report.wire_latency(shape) is None
    for cluster, late in (("c0", 0.0079), ("c1", 0.0083)):
        noted = replace(rollout(20), meta={"notes": f"ran to the end; {wire_note(late, 0.03)}"})
        write_rollout(paths.rollouts(1, cluster) / "rollouts" / "r.parquet", noted)
    late = report.wire_latency(shape)
    (effect,) = report.sealed_truth(late)["effects"]
    assert late == pytest.approx(0.0081) and effect["parameters"] == {"delay": late} and effect["where"] == []


def rollout(frames: int) -> Rollout:
    still = np.tile(stand_pose(), (frames, 1))
    return Rollout("r", joint_names(), 50, np.arange(frames) / 50, still, np.zeros((frames, 23)), joint_target=still)


def test_the_film_runs_the_counted_episodes_and_shows_the_first_robot_that_falls(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Same clips, seeds and start noise as in the evaluation; the compensated side gets the round's compensation."""
    asked: list[tuple] = []

    def run(*plan: object) -> dict[str, Rollout]:
        asked.append(plan)
        lengths = {"before-lean": 100, "before-walk": 60}  # lean is left without a fall
        return {e["rollout_id"]: rollout(lengths.get(e["rollout_id"], 100)) for e in plan[1]}  # type: ignore[attr-defined]

    clip = lambda name: SimpleNamespace(name=name, frames=100)  # noqa: E731
    monkeypatch.setattr(film, "run", run)
    monkeypatch.setattr(film, "as_evaluated", lambda names, _: [clip(name) for name in names])
    monkeypatch.setattr(film, "model_xml", str)
    stills = tuple((0.0, "data:image/png;base64,") for _ in range(6))
    monkeypatch.setattr(film, "film_pair", lambda *_: Film(stills, None, "no device"))
    turn = RoundResults(2, {}, {}, {}, {}, parent=1)
    choices = [Choice(motion, "c0", 5, "compensated", 40) for motion in ("lean", "walk")]
    blocks = film.pair_blocks(choices, turn, {"start_noise": {"joint_pos": 0.02}})
    policies, episodes, _, noise, compensations = asked[0]
    assert set(map(str, policies.values())) == {"models/experts/r1/c0"} and noise == {"joint_pos": 0.02}
    assert {e["seed"] for e in episodes} == {5} and list(compensations) == ["compensated-c0"]
    assert compensations["compensated-c0"].endswith("models/compensation/r2/compensation.json")
    captions = [block.caption for block in blocks if block.kind == "still"]
    assert captions[0].startswith("before: falls after 1.2 s") and captions[-1].startswith("compensated: followed")


def test_every_policy_is_compared_with_the_one_that_the_loop_began_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("data/evaluation").mkdir(parents=True)
    row = {"cluster": "c0", "family": "", "split": "train", "engine": "stand_in", "seed": 0, "mpjpe_rad": 0.1}
    row |= {"mpkpe_mm": 1.0, "frames": 9, "end_reason": "end", "round": None}
    rows = [
        {**row, "policy": policy, "kind": policy, "motion": motion, "success": policy != "base"}
        for policy in ("base", "other", "generalist")
        for motion in ("a", "b")
    ]
    pd.DataFrame(rows).to_parquet("data/evaluation/episodes.parquet")
    told = {"from": "base", "to": "generalist", "engine": "stand_in", "split": "all"}
    entries = [{"policy": policy} for policy in ("base", "other", "generalist")]
    found = report.with_reference({"results": entries, "comparisons": [told]})["comparisons"]
    assert found[0] == told and {(c["from"], c["to"]) for c in found} == {("base", "generalist"), ("base", "other")}
    assert next(c for c in found if c["to"] == "other" and c["split"] == "all")["success"]["value"] == 1.0


def test_the_picture_says_how_long_each_policy_trained_and_which_were_kept() -> None:
    results = loop_results([], None)
    steps = pd.DataFrame({"frames": [4096, 327_680]})
    kept = report.picture(replace(results, curves={"expert-c0 r1": steps, "expert-c1 r1": steps}))
    assert "<b>base</b><span>kept</span>" in kept and "<b>refine</b><span>327,680 steps</span>" in kept
    assert ", kept</span>" in kept and "<b>base</b><span>327,680 steps</span>" in report.picture(
        replace(results, curves={"base": steps})
    )
