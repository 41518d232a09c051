"""Trials on sealed robots: the policy sees readings, the judge the truth, and held-out motions are all among them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.sealed_trials import chosen_clips, follow_sealed
from bumblebee.learning import pretrained
from bumblebee.learning.policy import load_policy
from bumblebee.learning.rollout import Manner
from bumblebee.stand_in.process import BASES
from bumblebee.stand_in.sealed import entry
from bumblebee.stand_in.undeclared.faults import largest
from bumblebee.stand_in.undeclared.kinds import KINDS
from tasks.seal import drawn_place
from tests.benchmarks.study.study_folder import fill


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> Motions:
    folder: Path = tmp_path_factory.mktemp("motions")
    fill(folder)
    return read_motions(folder)


def test_a_policy_sees_readings_and_is_judged_by_the_truth(motions: Motions) -> None:
    """A drive that follows an encoder which is off holds its joint as far off, though the reading is as without."""
    policy, clips, seen = load_policy(pretrained.FOLDER), [row.clip for row in motions.rows[:2]], {}
    kind, place = KINDS["encoder_offset"], drawn_place("left_elbow_joint", np.random.default_rng(0))
    off = entry(kind, place, 0.5 * largest(kind, place))
    for name, effects in {"none": [], "again": [], "off": [off]}.items():
        seen[name] = follow_sealed(policy, Manner(policy.shape.seen), clips, effects, BASES[0])
    pd.testing.assert_frame_equal(seen["none"], seen["again"])
    assert list(seen["none"]["name"]) == [clip.name for clip in clips]
    away = seen["off"]["mpjpe_rad"] - seen["none"]["mpjpe_rad"]
    assert away.abs().to_numpy() == pytest.approx(0.5 * largest(kind, place) / 23, rel=0.2)  # of 23 joints' mean


def test_every_held_out_motion_is_followed_and_training_motions_of_each_cluster_all_cut(motions: Motions) -> None:
    clips = chosen_clips(motions, 0.5)
    held = motions.labels[motions.labels["split"] == "test"]["name"].tolist()
    assert [clip.name for clip in clips[: len(held)]] == held
    assert sorted(clip.name for clip in clips) == sorted(motions.labels["name"])  # fewer than are asked for: all
    assert max(clip.duration for clip in clips) <= 0.5
