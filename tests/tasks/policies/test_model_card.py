"""The model card: every part of every observation has its meaning, numbers have intervals, nothing is made up."""

import json
from pathlib import Path

import pandas as pd
import pytest

from bumblebee.learning.pretrained import MOTIONS, NAMES
from bumblebee.policy.describe import MEANINGS, meaning
from bumblebee.tracking.observing.terms import LAYOUTS, SETS, TERMS
from tasks.policies.model_card import Evaluated, licences_of, model_card
from tasks.running.run_form import fitted
from tests.policy.conftest import policy_folder  # noqa: F401

RESULT = {
    "n": 8,
    "success": {"value": 0.75, "ci95": [0.4, 0.93], "motions": 4},
    "mpjpe_rad": {"value": 0.05, "ci95": [0.04, 0.06]},
    "mpkpe_mm": {"value": None, "ci95": [None, None]},
}


def test_every_part_of_an_observation_has_meaning_unit_and_frame() -> None:
    home = "bumblebee.tracking"
    own = [term for name, term in TERMS.items() if term.__module__.startswith(home) and name not in LAYOUTS]
    laid = {name for layout in LAYOUTS.values() for name, _ in layout(23, 2)}
    names = {term.__name__ for term in own} | laid | {n for s in SETS.values() for n in s}
    for name in names:
        what, unit, frame = meaning(name, [0.1, 0.3])
        assert what and unit and frame, name
        assert "some" not in what
    assert set(MEANINGS) <= names


def test_the_card_says_what_it_takes_gives_and_is_worth(policy_folder) -> None:  # noqa: F811
    folder = policy_folder()
    (folder / "card.json").write_text(
        json.dumps(
            {"stage": "experts", "cluster": "c0", "round": 0, "frames": 2048, "learner": "ppo", "config": {"seed": 3}}
        )
    )
    card = model_card("expert-c0", "expert-c0-r0", folder, "base", Evaluated("a" * 64, "stand_in", RESULT), {"MIT": 2})
    for said in (
        "`obs` (N, 283) float32 in, `actions` (N, 23) float32 out, 50 times a second",
        "| 0:3 | gravity_b | direction of gravity | 1 | base |",
        "| 22 | right_elbow_joint |",
        "followed 75 % (95 % interval 40 to 93) of 8 runs over 4 motions",
        "error of joint angles: 0.05 rad (95 % interval 0.04 to 0.06)",
        "- from: base",
        "- seed: 3",
        "- learner: ppo",
        "- licences of the motions: MIT (2)",
        "Sensors: imu, heading, encoders, velocity, height, place.",
        "Simulation only",
        "No safety layer",
        "holds a target for 20 ms",
    ):
        assert said in card, said
    assert "nan" not in card and "None" not in card and "key bodies: 0" not in card
    assert len(card) <= 5000, "MLflow's tables hold no more"


def test_what_is_not_known_is_said_to_be_so(policy_folder, tmp_path: Path) -> None:  # noqa: F811
    card = model_card("base", "base", policy_folder(), None, Evaluated("b", "nominal", RESULT), licences_of(tmp_path))
    assert "- from: not said" in card and "- seed: not said" in card and "- licences of the motions: unknown" in card


def test_a_card_names_what_the_shipped_weights_have_learnt_from(policy_folder) -> None:  # noqa: F811
    folder = policy_folder()
    for shipped in MOTIONS:
        known = [f"`{NAMES[shipped]}`: {MOTIONS[shipped]}"]
        card = model_card("base", "base", folder, None, Evaluated("b", "nominal", RESULT), {"MIT": 2}, known)
        assert f"- its weights have also learnt from `{NAMES[shipped]}`: {MOTIONS[shipped]}" in card and "CC BY" in card
        assert len(card) <= 5000, "MLflow's tables hold no more"


def test_licences_are_counted(tmp_path: Path) -> None:
    pd.DataFrame({"licence": ["MIT", "MIT", ""]}).to_parquet(tmp_path / "index.parquet")
    assert licences_of(tmp_path) == {"MIT": 2, "unknown": 1}


def test_a_card_says_what_forbids_commercial_use_and_is_silent_where_nothing_does(policy_folder) -> None:  # noqa: F811
    folder = policy_folder()

    def card(licences: dict[str, int]) -> str:
        return model_card("base", "base", folder, None, Evaluated("b", "nominal", RESULT), licences)

    told = card({"MIT": 5, "CC-BY-NC-4.0": 2, "unknown": 3})
    assert "- licences of the motions: MIT (5), CC-BY-NC-4.0 (2), unknown (3)\n" in told
    assert "- **trained on motions that may not be used commercially: CC-BY-NC-4.0**\n" in told
    assert "- **licence unknown for 3 motions: ask before commercial use**\n" in told
    assert "commercial" not in card({"MIT": 5, "Apache-2.0": 1})


@pytest.mark.parametrize("length", [99, 100, 101, 5000])
def test_what_does_not_fit_says_how_long_it_is_and_where_it_is_whole(length: int) -> None:
    kept = fitted("x" * length, 100, "lineage.json")
    assert len(kept) <= 100
    assert kept == "x" * length if length <= 100 else f"{length:,} characters: whole in lineage.json" in kept
