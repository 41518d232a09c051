"""A file is taken for a motion of AMASS where its path says exactly one, and for none otherwise."""

from pathlib import Path

import pytest

from bumblebee.motion.describe.amass import Motions, key_of_index

KEYS = [
    ("CMU", "01", "01_01"),
    ("CMU", "18_19_rory", "18_13"),
    ("CMU", "18_19_Justin", "18_13"),
    ("KIT", "3", "kick_high_left02"),
    ("KIT", "572", "kick_high_left02"),
    ("BioMotionLab_NTroje", "rub055", "0008_normal_walk4"),
    ("ACCAD", "Male2Walking_c3d", "B17_-_Walk_to_hop"),
]
MOTIONS = Motions(KEYS)


@pytest.mark.parametrize(
    ("path", "name", "key"),
    [
        ("amass/KIT/3/kick_high_left02_poses.npz", "", KEYS[3]),
        ("amass/KIT/572/kick_high_left02_stageii.npz", "", KEYS[4]),
        ("KIT/3/kick_high_left02.csv", "", KEYS[3]),  # a retarget that kept the name
        ("KIT.zip/3/kick_high_left02_poses.npz", "", KEYS[3]),
        ("BMLrub.tar.bz2/BMLrub/rub055/0008_normal_walk4_poses.npz", "", KEYS[5]),
        ("ACCAD/Male2Walking_c3d/B17 -  Walk to hop_poses.npz", "", KEYS[6]),
        ("ACCAD/Male2Walking_c3d/B17_-__Walk_to_hop_stageii.npz", "", KEYS[6]),
        ("h1/amass.pkl", "0-KIT_3_kick_high_left02_poses", KEYS[3]),  # PHC's names
        ("h1/0-BioMotionLab_NTroje_rub055_0008_normal_walk4_poses.pkl", "", KEYS[5]),
        ("cmu_bvh.zip/cmu_bvh/01_01.bvh", "01_01", KEYS[0]),
        ("cmuconvert-mb2-01-09/01/01_01.bvh", "", KEYS[0]),
        ("CMU/18_19_rory/18_13_poses.npz", "", KEYS[1]),
    ],
)
def test_a_path_or_name_that_says_one_motion_is_that_motion(path, name, key):
    assert MOTIONS.find(Path(path), name).key == key


@pytest.mark.parametrize(
    ("path", "note"),
    [
        ("mine/01_01.bvh", ""),  # nothing says CMU
        ("acmus/01_01.bvh", ""),
        ("home/cmu/a/b/c/01_01.bvh", ""),  # too far above to speak of this file
        ("cmu/1_1.bvh", ""),
        ("KIT/3/kick_high_left2_poses.npz", ""),
        ("KIT/4/kick_high_left02_poses.npz", ""),
        ("mine/3/kick_high_left02_poses.npz", "may be KIT/3/kick_high_left02"),
        ("cmu/18_13.bvh", "CMU/18_19_Justin/18_13 or CMU/18_19_rory/18_13"),
    ],
)
def test_a_path_that_does_not_say_which_gets_none_and_a_reason_where_it_comes_near(path, note):
    found = MOTIONS.find(Path(path))
    assert found.key is None and note in found.note and bool(found.note) == bool(note)


@pytest.mark.parametrize("path", ["x.npy", "./pose_data/Nowhere/3/x_poses.npy", "KIT/../x_poses.npy", ""])
def test_a_path_of_the_index_that_names_no_motion_is_none(path):
    assert key_of_index(path) is None
