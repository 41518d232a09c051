"""A caption is paired with the windows that it describes; texts without words of their own pair with none."""

from dataclasses import replace

import numpy as np
import pandas as pd

from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.features import POSITIONS, positions, window_frames, window_times
from bumblebee.clustering.map import SIGNS, STEP, motion_map, written
from bumblebee.clustering.material import describing, gather, material_of
from bumblebee.clustering.poses import BONES, COUNT, poses
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import joint_names, stand_pose
from tests.clustering.conftest import made_clip

CONFIG = ClusterConfig(window_seconds=2.0)
LONG = made_clip("long", "walk", seconds=6.0)


def test_a_caption_goes_with_the_windows_that_it_describes() -> None:
    lines = ("a person walks#a/DET#0.0#0.0", "a person kicks#a/DET#2.1#3.9")
    own = material_of(replace(LONG, captions=lines), CONFIG)
    assert own.texts == (("a person walks",), ("a person walks", "a person kicks"), ("a person walks",))
    assert own.captions == ("a person walks", "a person kicks") == own.written


def test_a_clip_whose_captions_describe_another_part_has_a_window_without_text() -> None:
    own = material_of(replace(LONG, captions=("a person kicks#a/DET#4.5#5.9",)), CONFIG)
    assert own.texts == ((), (), ("a person kicks",))


def test_a_plain_sentence_describes_all_of_the_clip() -> None:
    assert describing(["a person walks", "", "#x#0#0"], 3.0, 4.0) == ("a person walks##0#0",)


def test_words_of_names_are_no_evidence_and_the_sources_are_told() -> None:
    named = material_of(replace(LONG, caption_source="name"), CONFIG)
    assert named.captions and named.written == () and named.source == "name"
    assert material_of(replace(LONG, captions=(), caption_source=""), CONFIG).source == "none"


def test_windows_touch_and_cover_the_clip() -> None:
    times = window_times(LONG, 5.0, 2.0)
    assert [b for _, b in times[:-1]] == [a for a, _ in times[1:]]
    assert times[0][0] == 0.0 and times[-1][1] == LONG.duration
    assert np.concatenate(window_frames(LONG, 5.0, 2.0)).tolist() == list(range(0, 300, 10))


def test_the_head_stands_above_the_torso_and_bows_with_it() -> None:
    """0.43 m along the torso: 30 degrees of waist pitch take it 0.215 m forward and 58 mm down."""
    pose = np.tile(stand_pose(), (2, 1))
    pose[1, joint_names().index("waist_pitch_joint")] = np.pi / 6
    clip = make_clip("bow", 50.0, np.tile([0, 0, 0.78], (2, 1)), np.tile([1.0, 0, 0, 0], (2, 1)), pose)
    found = positions(clip, np.arange(2))
    above = found[:, POSITIONS.index("head")] - found[:, POSITIONS.index("torso_link")]
    np.testing.assert_allclose(above, [[0, 0, 0.43], [0.215, 0, 0.43 * np.cos(np.pi / 6)]], atol=1e-4)


def test_poses_are_read_back_from_their_signs_within_a_step() -> None:
    clip = made_clip("walk", "walk", seed=2)
    signs = written(drawn := poses(clip))
    assert drawn.shape == (COUNT, len(POSITIONS), 2) and len(signs) == drawn.size and "&" not in SIGNS
    back = np.array([SIGNS.index(sign) for sign in signs]).reshape(drawn.shape) * STEP - (0.9, 0.0)
    assert abs(back - drawn).max() <= STEP / 2 + 1e-6
    assert {point for bone in BONES for point in bone} == set(range(len(POSITIONS)))


def test_poses_do_not_depend_on_where_the_motion_begins() -> None:
    turned = made_clip("walk", "walk", seed=2)
    moved = make_clip("walk", 50.0, turned.root_pos + np.array([3.0, -2.0, 0.0]), turned.root_quat, turned.joint_pos)
    np.testing.assert_allclose(poses(moved), poses(turned), atol=1e-5)


def test_the_map_has_a_row_for_each_clip_and_poses_for_so_many(library: list[Clip]) -> None:
    materials = gather(library, CONFIG)
    labels = pd.DataFrame({"name": [clip.name for clip in library]}).assign(cluster="c0", x=0.0, y=0.0)
    labels["split"], labels["family"] = "train", ""
    table = motion_map(materials, labels, most=5)
    assert table["name"].tolist() == [clip.name for clip in library] and (table["poses"] != "").sum() == 5
    assert table["caption"].str.startswith("a person").all()
