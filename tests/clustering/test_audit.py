"""Statistics against known motions, names, keywords, agreement, stability and the random control."""

import numpy as np
import pandas as pd
import pytest

from bumblebee.clustering.audit import balance, cluster_table, family_agreement, random_control, separation
from bumblebee.clustering.kinds import RULES, kinds
from bumblebee.clustering.stability import over_k, stability
from bumblebee.clustering.statistics import COLUMNS, LOWER, MORE, UPPER, clip_statistics, keywords, names
from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import joint_names, stand_pose
from tests.clustering.conftest import TEXTS
from tests.clustering.test_kmeans import blobs


def test_statistics_of_a_ramp() -> None:
    """2 s at 0.5 m/s forward and 0.1 m/s up, one knee at 1 rad/s."""
    time = np.arange(101) / 50.0
    root = np.stack([0.5 * time, 0 * time, 1.5 + 0.1 * time], 1)
    joint_pos = np.tile(stand_pose(), (101, 1))
    joint_pos[:, joint_names().index("left_knee_joint")] += time
    numbers = clip_statistics(make_clip("ramp", 50.0, root, np.tile([1.0, 0, 0, 0], (101, 1)), joint_pos))
    expected = (1.0, 1000 * 0.1 / 30, 0.5, 1 / 23, 1 / 12, 0.0, 1.0, 0.0, 1.5)
    assert numbers == pytest.approx(dict(zip((*COLUMNS, *MORE), expected, strict=True)), abs=1e-4)
    assert len(LOWER) == 12 and len(UPPER) == 11


def test_keywords_are_what_sets_a_cluster_apart() -> None:
    captions = [(TEXTS["stand"],), (TEXTS["walk"], "the person quickly walks"), (TEXTS["stand"],), ()]
    words = keywords(captions, np.array([0, 1, 0, 2]), 3)
    assert (
        words[0][:2] == ["stands", "waves"]
        and "walks" in words[1]
        and all("person" not in row for row in words)
        and words[2] == []
    )
    assert keywords([(), ()], np.array([0, 1]), 2) == [[], []]


def test_words_that_nearly_all_captions_have_and_verbs_of_templates_are_no_keywords() -> None:
    captions = [(f"a person performs slowly {what}",) for what in ("walking", "walking", "waving", "waving", "waving")]
    assert keywords(captions, np.array([0, 0, 1, 1, 1]), 2) == [["walking"], ["waving"]]


def test_a_word_that_is_no_more_frequent_in_a_cluster_than_elsewhere_does_not_name_it() -> None:
    captions = [("walks left",), ("walks",), ("waves left",), ("waves",)]
    assert keywords(captions, np.array([0, 0, 1, 1]), 2) == [["walks"], ["waves"]]


def test_names_follow_the_papers_table() -> None:
    """Jump, two walks by speed, three stands by the legs' share."""
    rows = [
        (0.1, 0.33, 0.35, 0.4),
        (0, 0.35, 0.36, 0.2),
        (0, 0.43, 0.47, 0.4),
        (0, 0.06, 0.14, 0.31),
        (0, 0.12, 0.17, 0.22),
    ]
    rows.append((0, 0.15, 0.28, 0.27))
    table = pd.DataFrame(rows, columns=["airborne", "speed", "lower_joint", "upper_joint"]).assign(
        z_move=[9.0, 1.0, 5.0, 0.7, 0.8, 1.5]
    )
    assert names(table) == ["jump", "walk-slow", "walk-fast", "stand-up", "stand-mid", "stand-low"]
    floating = table.assign(airborne=0.1, z_move=3.0)  # poor motion capture: feet hover, but no cluster bounces
    assert not any("jump" in name for name in names(floating))
    many = pd.concat([table.iloc[[3]].assign(lower_joint=0.1 * i) for i in range(1, 6)])
    assert len(set(names(many))) == 5


def test_cluster_table_has_a_row_for_each_cluster() -> None:
    statistics = pd.DataFrame({name: [1.0, 3.0, 5.0] for name in COLUMNS})
    table = cluster_table(statistics, [("walks",)] * 3, np.array([1, 1, 0]), 2)
    assert table["clips"].tolist() == [1, 2] and table["speed"].tolist() == [5.0, 2.0]


def test_agreement_counts_known_families_only() -> None:
    assert family_agreement(["a", "a", "b", "b", ""], np.array([1, 1, 0, 0, 0]))["value"] == 1.0
    assert family_agreement(["", "", "a"], np.array([0, 1, 1])) is None


def test_clear_clusters_are_stable_and_noise_is_not() -> None:
    clear, _ = blobs((10, 10, 10))
    noise = np.random.default_rng(0).normal(size=(30, 5))
    assert stability(clear, (), 3, 4)["subsamples"]["value"] == pytest.approx(1.0)
    assert stability(noise, (), 3, 4)["subsamples"]["value"] < 0.8


def test_random_split_explains_less() -> None:
    truth = np.repeat([0, 1], 20)
    values = truth + 0.1 * np.random.default_rng(0).normal(size=40)
    statistics = pd.DataFrame(dict.fromkeys(COLUMNS, values)).assign(airborne=0.0)
    ours, chance = separation(statistics, truth), random_control(statistics, truth, 20).mean()
    assert ours["speed"] > 0.9 and chance["speed"] < 0.2 and ours["airborne"] == 0.0
    by_hand = 1 - np.mean([values[truth == c].var() for c in (0, 1)]) / values.var()
    assert ours["speed"] == pytest.approx(by_hand)


def test_the_papers_own_table_gets_the_papers_own_names() -> None:
    """All six rows of its table 2; it counts no frames in the air."""
    columns = ["displacement", "z_move", "speed", "joint", "lower_joint", "upper_joint"]
    rows = {
        "jump": (2.32, 9.21, 0.329, 0.379, 0.346, 0.405),
        "walk-slow": (3.42, 1.60, 0.353, 0.279, 0.358, 0.215),
        "walk-fast": (3.24, 5.63, 0.429, 0.430, 0.472, 0.396),
        "stand-up": (0.89, 0.68, 0.061, 0.230, 0.136, 0.305),
        "stand-mid": (1.33, 0.82, 0.119, 0.198, 0.170, 0.221),
        "stand-low": (1.84, 1.52, 0.148, 0.274, 0.281, 0.267),
    }
    table = pd.DataFrame.from_dict(rows, orient="index", columns=columns)
    assert names(table) == list(rows)
    assert names(table.iloc[::-1]) == list(rows)[::-1]


def test_kinds_follow_their_rules() -> None:
    plain = {"airborne": 0.0, "z_move": 0.5, "displacement": 0.1, "lowest": 0.75, "turn": 0.1}
    plain |= {"upper_joint": 0.05, "lower_joint": 0.05}
    changed = [
        {"airborne": 0.2, "z_move": 6.0, "displacement": 2.0}, {"displacement": 1.2, "turn": 3.0}, {"lowest": 0.5},
        {"turn": 1.6}, {"upper_joint": 0.4}, {"upper_joint": 0.4, "lower_joint": 0.3}, {"airborne": 0.9},
    ]  # fmt: skip
    found = kinds(pd.DataFrame([{**plain, **row} for row in changed]))
    assert found.tolist() == ["airborne", "travelling", "crouching", "turning", "arms", "legs", "still"]
    assert [name for name, _ in RULES] == found.tolist()


def test_balance_is_one_for_equal_sizes() -> None:
    assert balance(np.repeat([0, 1, 2], 5), 3)["evenness"] == pytest.approx(1.0)
    uneven = balance(np.array([0] * 9 + [1]), 2)
    assert (uneven["smallest"], uneven["largest"]) == (0.1, 0.9) and uneven["evenness"] < 0.5


def test_retrained_latents_that_say_the_same_agree_over_k_and_others_do_not() -> None:
    clear, truth = blobs((10, 10, 10))
    noise = np.random.default_rng(2).normal(size=clear.shape)
    table = over_k(clear, [clear * 2, clear[:, ::-1]], truth, 4, 3).set_index("k")
    assert (
        table.loc[3, "retrained"] == pytest.approx(1.0) == table.loc[3, "with_used"] and table.loc[2, "with_used"] < 1
    )
    assert stability(clear, [noise], 3, 3)["retrained"]["value"] < 0.3
