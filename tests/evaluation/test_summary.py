"""The summary: groups, pooled experts, paired comparisons."""

import json

import pandas as pd
import pytest

from bumblebee.evaluation.summary import COLUMNS, compare, comparisons, results, same_files, unchanged_pairs


def rows(
    policy: str, kind: str, number: int | None, motions: dict[str, str], success: list[bool], mm: float
) -> pd.DataFrame:
    table = [
        (
            policy,
            kind,
            number,
            cluster,
            motion,
            "squat",
            "train",
            "nominal",
            0,
            good,
            mm / 1000,
            mm,
            10,
            "end" if good else "fall",
        )
        for (motion, cluster), good in zip(motions.items(), success, strict=True)
    ]
    return pd.DataFrame(table, columns=list(COLUMNS)).astype({"round": "Int64"})


MOTIONS = {f"m{i}": "c0" if i < 4 else "c1" for i in range(8)}
FIRST = dict(list(MOTIONS.items())[:4])
SECOND = dict(list(MOTIONS.items())[4:])
EPISODES = pd.concat(
    [
        rows("base", "base", None, MOTIONS, [False] * 6 + [True] * 2, 50.0),
        rows("expert-c0-r0", "expert", 0, FIRST, [True] * 4, 30.0),
        rows("expert-c1-r0", "expert", 0, SECOND, [False, True, True, True], 20.0),
    ],
    ignore_index=True,
)


def test_experts_of_a_round_are_also_counted_together() -> None:
    whole = {r["policy"]: r for r in results(EPISODES) if r["split"] == r["group"] == "all"}
    assert whole["base"]["success"]["value"] == pytest.approx(0.25)
    assert whole["experts-r0"]["success"]["value"] == pytest.approx(7 / 8) and whole["experts-r0"]["n"] == 8
    assert whole["experts-r0"]["round"] == 0 and whole["base"]["round"] is None
    assert whole["experts-r0"]["mpkpe_mm"]["value"] == pytest.approx(25.0)
    assert whole["experts-r0"]["mpkpe_mm_successful"]["value"] == pytest.approx((4 * 30 + 3 * 20) / 7)
    assert whole["experts-r0"]["end_reasons"] == {"end": 7, "fall": 1}


def test_groups_are_of_the_motions() -> None:
    by_cluster = {
        r["group"]: r["success"]
        for r in results(EPISODES)
        if r["policy"] == "base" and r["group_by"] == "cluster" and r["split"] == "all"
    }
    assert by_cluster["c0"]["value"] == 0.0 and by_cluster["c1"]["value"] == 0.5
    assert by_cluster["c0"]["ci95"][0] == 0.0 and by_cluster["c0"]["ci95"][1] > 0.3


def test_a_comparison_pairs_motions_and_says_how_sure_it_is() -> None:
    """Five of eight motions won and none lost: both exact tests give 2/32."""
    entry = compare(EPISODES, "base", "experts-r0", "nominal", "all")
    assert entry is not None and entry["motions"] == 8
    assert entry["success"]["value"] == pytest.approx(5 / 8)
    assert entry["success"]["p"] == pytest.approx(2 / 32) and entry["mcnemar_p"] == pytest.approx(2 / 32)
    assert entry["mpkpe_mm"]["value"] == pytest.approx(-30.0) and entry["mpkpe_mm"]["motions"] == 2


def test_policies_without_common_episodes_are_not_compared() -> None:
    assert compare(EPISODES, "expert-c0-r0", "expert-c1-r0", "nominal", "all") is None
    assert compare(EPISODES, "base", "generalist", "nominal", "all") is None


FILES = {
    "untrained": "u", "base": "b", "expert-c0-r0": "b", "expert-c1-r0": "b", "expert-c0-r1": "b", "expert-c1-r1": "new",
    "expert-c0-r2": "b", "expert-c1-r2": "new", "generalist": "g",
}  # fmt: skip


@pytest.mark.parametrize(
    ("first", "second", "same"),
    [("untrained", "base", False), ("base", "base", True), ("base", "experts-r0", True), ("experts-r0", "base", True),
     ("experts-r0", "experts-r1", False), ("base", "experts-r1", False), ("experts-r1", "experts-r2", True),
     ("experts-r1", "generalist", False), ("expert-c0-r0", "expert-c0-r1", True), ("experts-r7", "base", False),
     ("experts-r7", "experts-r8", False), ("nobody", "base", False), ("nobody", "nobody", False)],
)  # fmt: skip
def test_a_ladder_is_unchanged_only_where_every_clusters_file_is(first: str, second: str, same: bool) -> None:
    assert same_files(FILES, first, second) is same
    assert unchanged_pairs(FILES, [(first, second)]) == ({(first, second)} if same else set())


def test_clusters_of_one_round_alone_do_not_count_and_names_may_look_like_rounds() -> None:
    files = {"expert-walk-r1-r0": "a", "expert-walk-r1-r1": "a", "expert-sit-r1": "z", "expert-walk-r0": "y"}
    assert same_files(files, "experts-r0", "experts-r1")
    assert not same_files(files | {"expert-sit-r0": "x"}, "experts-r0", "experts-r1")


def test_the_summary_is_strict_json() -> None:
    content = {
        "results": results(EPISODES),
        "comparisons": comparisons(EPISODES, [("base", "experts-r0"), ("base", "none")]),
    }
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    assert len(content["comparisons"]) == 2
