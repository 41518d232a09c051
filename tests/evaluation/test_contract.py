"""The frozen evaluation: any change changes its hash, and a changed one is refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.evaluation.contract import (
    Contract,
    StartNoise,
    Thresholds,
    clip_digest,
    freeze,
    read_contract,
    require_same,
    write_contract,
)
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.policy.episodes import FALL_RULE
from bumblebee.robot.facts import stand_pose


def clip(name: str = "a", far: float = 1.2, bend: float = 0.0) -> Clip:
    pose = np.tile(stand_pose() + bend, (4, 1))
    root_pos = np.linspace([0.0, 0.0, 0.0], [0.0, far, 0.0], 4)
    return make_clip(name, 50.0, root_pos, np.tile([1.0, 0, 0, 0], (4, 1)), pose)


def contract() -> Contract:
    return freeze(
        [clip("b", 0.1), clip("a")], (0, 1), engines={"nominal": {"timestep": 0.005}}, fall={"tilt_deg": 60.0}
    )


def test_the_rules_of_loss_stay_those_that_are_frozen() -> None:
    """The rules of a fall and of key bodies decide the hash; results under another are not compared."""
    clips = [clip("b", 0.1), clip("a")]
    frozen = freeze(clips, (0, 1), engines={"nominal": {"timestep": 0.005}}, fall=FALL_RULE)
    assert frozen.sha256 == "2cc348b091de7ccde4f168223a4a7e8dbc4ca6af69106f7840b2e0d676d6d099"


def test_each_fields_change_changes_the_hash() -> None:
    one = contract()
    changes = {
        "motions": one.motions[:1],
        "seeds": (0, 2),
        "thresholds": Thresholds(walking=0.7),
        "start_noise": StartNoise(joint_vel=0.0),
        "engines": {"nominal": {"timestep": 0.004}},
        "fall": {"tilt_deg": 59.0},
        "alignment": "by Procrustes",
        "errors": "medians",
        "travels": 2.0,
    }
    assert set(changes) == set(one.__dataclass_fields__)
    hashes = {replace(one, **{field: value}).sha256 for field, value in changes.items()}
    assert len(hashes | {one.sha256}) == len(changes) + 1


def test_the_hash_is_of_the_frames_and_not_of_the_order() -> None:
    assert freeze([clip("a"), clip("b")], (0,)).sha256 == freeze([clip("b"), clip("a")], (0,)).sha256
    assert clip_digest(clip()) != clip_digest(clip(bend=1e-3))
    assert clip_digest(clip()) == clip_digest(replace(clip(), captions=("a man stands",), source="elsewhere"))


def test_walking_may_be_further_off() -> None:
    assert {m["name"]: m["threshold_m"] for m in contract().motions} == {"a": 0.8, "b": 0.4}


def test_what_is_written_is_read_again_and_an_edited_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "contract.json"
    write_contract(path, contract())
    assert read_contract(path) == json.loads(json.dumps(contract().as_dict()))
    path.write_text(path.read_text().replace("0.8", "0.9"))
    with pytest.raises(BadInput, match="field sha256"):
        read_contract(path)


def test_two_different_evaluations_are_not_compared() -> None:
    one, other = contract(), replace(contract(), seeds=(7,))
    require_same(one.as_dict(), contract().as_dict(), "here")
    with pytest.raises(BadInput, match="here: seeds: expected"):
        require_same(one.as_dict(), other.as_dict(), "here")
