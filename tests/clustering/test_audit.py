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


PLAIN = {"displacement": 2.0, "z_move": 2.0, "speed": 0.4, "joint": 0.4, "lower_joint": 0.4, "upper_joint": 0.4,
         "airborne": 0.0, "turn": 0.2, "lowest": 0.75}  # fmt: skip


def clips_of(*clusters: dict[str, float]) -> tuple[pd.DataFrame, np.ndarray]:
    """Statistics of three clips a cluster around a plain walk's, and their labels."""
    rows = [
        {name: value * share for name, value in (PLAIN | own).items()} for own in clusters for share in (0.98, 1, 1.02)
    ]
    return pd.DataFrame(rows), np.repeat(np.arange(len(clusters)), 3)


def test_clusters_are_called_after_the_commonest_kind_of_their_clips() -> None:
    jump, stand = {"airborne": 0.3, "z_move": 9.0}, {"displacement": 0.1, "lower_joint": 0.05, "upper_joint": 0.06}
    assert names(*clips_of({}, jump, stand, {"displacement": 0.2, "lowest": 0.5}), 4) == [
        "travelling", "airborne", "still", "crouching"
    ]  # fmt: skip
    assert names(*clips_of({}, stand), 3) == ["travelling", "still", "empty"]


def test_six_clusters_of_walks_have_six_names_that_say_what_each_is() -> None:
    walks = (
        {"speed": 2.0},
        {"turn": 4.0},
        {"lowest": 0.4},
        {"upper_joint": 1.6},
        {"z_move": 8.0},
        {"displacement": 9.0},
    )
    assert names(*clips_of(*walks), 6) == [
        f"travelling-{word}" for word in ("fast", "turning", "low", "lively-arms", "bouncing", "far")
    ]
    slow, fast = names(*clips_of({"speed": 0.2}, {"speed": 0.9}), 2)
    assert (slow, fast) == ("travelling-slow", "travelling-fast")
    assert len(set(names(*clips_of(*[{}] * 20), 20))) == 20


def test_cluster_table_has_a_row_for_each_cluster() -> None:
    statistics = pd.DataFrame({name: [1.0, 3.0, 5.0] for name in (*COLUMNS, *MORE)})
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
