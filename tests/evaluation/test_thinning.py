"""A thinned evaluation keeps what is scarce: held-out motions and small clusters."""

import pandas as pd
import pytest

from bumblebee.evaluation.thinning import thin


def library(train: dict[str, int], test: dict[str, int]) -> pd.DataFrame:
    """So many motions of each cluster."""
    rows = [
        (f"{split}_{cluster}_{i:03d}", split, f"f{i % 3}", cluster)
        for split, counts in (("train", train), ("test", test))
        for cluster, count in counts.items()
        for i in range(count)
    ]
    return pd.DataFrame(rows, columns=["name", "split", "family", "cluster"]).sample(frac=1.0, random_state=0)


def split_of(names: list[str], split: str) -> int:
    return sum(name.startswith(split) for name in names)


def test_a_small_library_is_kept_whole() -> None:
    index = library({"c0": 5, "c1": 3}, {"c0": 2})
    assert sorted(thin(index, 10)) == sorted(index["name"])


@pytest.mark.parametrize(("held_out", "kept"), [(7, 7), (10, 10), (40, 10)])
def test_held_out_motions_are_kept_up_to_half(held_out: int, kept: int) -> None:
    names = thin(library({"c0": 300}, {"c0": held_out}), 20)
    assert len(names) == len(set(names)) == 20 and split_of(names, "test") == kept


def test_a_cluster_of_one_motion_among_hundreds_is_there() -> None:
    names = thin(library({"c0": 400, "c1": 1, "c2": 300}, {"c0": 30}), 12)
    assert "train_c1_000" in names and any("_c2_" in name for name in names) and len(names) == 12


def test_every_cluster_comes_before_the_limit() -> None:
    names = thin(library({f"c{i}": 4 for i in range(5)}, {"c0": 4}), 2)
    assert {name.split("_")[1] for name in names} == {f"c{i}" for i in range(5)}


def test_few_training_motions_leave_their_room_to_held_out_ones() -> None:
    names = thin(library({"c0": 3}, {"c0": 30}), 20)
    assert split_of(names, "train") == 3 and split_of(names, "test") == 17


def test_the_choice_does_not_depend_on_the_order_of_the_rows() -> None:
    index = library({"c0": 50, "c1": 20}, {"c1": 9})
    assert thin(index, 11) == thin(index.iloc[::-1], 11)
