"""Robots: drawn by seed, sized by a search that goes on where it was ended, sealed."""

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from benchmarks.motion_pack import Packed, write_pack
from benchmarks.study import robots
from benchmarks.study.motions import LABELS, MOTIONS, read_motions
from benchmarks.study.robots import ANKLES, GROUND, SMALL_CONFIG, Outcome, RobotsConfig, drawn, main, search, sized
from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.stand_in.sealed import read_sealed
from tests.benchmarks.study.study_folder import short_clips

CONFIG = RobotsConfig()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four short motions in two clusters."""
    folder = tmp_path_factory.mktemp("motions")
    clips = short_clips(4)
    write_pack(folder / MOTIONS, [Packed("made", True, replace(clip, split="train")) for clip in clips])
    names = [clip.name for clip in clips]
    labels = pd.DataFrame({"name": names, "motion": names, "group": "made", "family": [c.family for c in clips]})
    labels.assign(split="train", seconds=1.0, cluster=["c0", "c0", "c1", "c1"]).to_csv(folder / LABELS, index=False)
    return folder


@pytest.mark.parametrize("seed", CONFIG.seeds)
def test_a_robot_has_effects_of_the_ground_and_outside_the_catalogue_each_at_a_place_of_its_own(seed: int) -> None:
    effects = drawn(CONFIG, seed, 0)
    assert sum(kind.name in GROUND for kind, _ in effects) == 1
    assert sum(kind.outside for kind, _ in effects) == CONFIG.outside
    assert len(effects) == 1 + CONFIG.inside + CONFIG.outside
    assert len({(kind.on, place.name) for kind, place in effects}) == len(effects)


def test_robots_that_differ_at_the_ankles_alone_grow_with_the_factor_and_a_cable_runs_over_ankle_and_knee() -> None:
    weak, cables = ([sized(ANKLES, seed, 0, factor) for factor in (0.3, 2.5)] for seed in ANKLES.seeds)
    for small, large in (weak, cables):
        assert [own["where"] for own in small] == [["left_ankle_pitch_joint"], ["right_ankle_pitch_joint"]]
        assert all(a["size"] < b["size"] for a, b in zip(small, large, strict=True))
    assert {own["effect"] for own in weak[0]} == {"motor_strength"}
    assert all(own["parameters"]["factor"] < 1 for own in weak[0])
    assert [own["draw"]["other"] for own in cables[0]] == ["left_knee_joint", "right_knee_joint"]


def test_a_draw_is_the_same_again_and_grows_with_its_factor() -> None:
    for seed in CONFIG.seeds:
        assert sized(CONFIG, seed, 0, 0.5) == sized(CONFIG, seed, 0, 0.5)
        sizes = [[effect["size"] for effect in sized(CONFIG, seed, 0, factor)] for factor in (0.3, 0.6, 2.5)]
        assert all(a <= b <= c for a, b, c in zip(*sizes, strict=True))
        assert sizes[0] != sizes[2]
    assert sized(CONFIG, 1801, 0, 0.5) != sized(CONFIG, 1801, 1, 0.5)


def test_the_search_ends_within_its_bounds_or_says_that_it_did_not() -> None:
    found = search(CONFIG, lambda attempt, factor: Outcome(max(0.0, 1 - factor / 3), 5.0))
    assert found is not None
    assert CONFIG.at_least <= found[2].success <= CONFIG.at_most
    assert search(CONFIG, lambda attempt, factor: Outcome(1.0, 5.0)) is None
    assert search(CONFIG, lambda attempt, factor: Outcome(0.5, 0.5)) is None
    steep = search(CONFIG, lambda attempt, factor: Outcome(0.5 if attempt else float(factor < 0.4), 5.0))
    assert steep is not None
    assert steep[0] == 1


def test_a_run_that_was_ended_tries_nothing_twice_and_what_it_keeps_names_no_effect(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    motions, policy = read_motions(folder), pretrained.FOLDER
    config = replace(SMALL_CONFIG, at_least=0.0, at_most=1.0, max_seconds=0.2)
    robots.seal_robots(policy, motions, config, tmp_path, 1)
    sealed = tmp_path / "robot-0.json"
    assert len(read_sealed(sealed)) == 5
    assert read_sealed(tmp_path / "declared.json") == []
    kept = (tmp_path / "robot-0.tries.jsonl").read_text() + (tmp_path / "followed.json").read_text()
    assert not any(kind.name in kept for kind, _ in drawn(config, config.seeds[0], 0))
    before = sealed.read_bytes()
    sealed.unlink()
    with (tmp_path / "robot-0.tries.jsonl").open("a") as file:
        file.write('{"attempt": 0, "fac')
    monkeypatch.setattr(robots, "trial", lambda *_: pytest.fail("tried again"))
    robots.seal_robots(policy, motions, config, tmp_path, 1)
    assert sealed.read_bytes() == before
    with pytest.raises(BadInput, match=r"study\.trial_seed"):
        robots.seal_robots(policy, motions, replace(config, trial_seed=7), tmp_path, 1)
    content = json.loads(before)
    content["effects"][0]["size"] *= 0.9
    sealed.write_text(json.dumps(content))
    with pytest.raises(BadInput, match=r"field sha256: expected .* The file was changed"):
        robots.seal_robots(policy, motions, config, tmp_path, 1)


def test_a_folder_without_a_policy_is_refused_before_anything_is_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    (tmp_path / "other").mkdir()
    with pytest.raises(SystemExit) as end:
        main([str(tmp_path / "other"), "--motions", str(folder), "--out", str(tmp_path / "new")])
    assert end.value.code == 2
    assert "no policy.pt" in capsys.readouterr().out
    assert not (tmp_path / "new").exists()
