"""From clips to labels: motions that differ end up apart."""

from dataclasses import replace

import pytest
from sklearn.metrics import adjusted_rand_score

from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.pipeline import Clustering, cluster_clips
from bumblebee.clustering.text import TokenTable
from bumblebee.clustering.train import planned_epochs
from bumblebee.errors import BadInput
from bumblebee.motion.captions import caption_from_name
from bumblebee.motion.clip import Clip


@pytest.fixture(scope="module")
def result(library: list[Clip], table: TokenTable, tiny: ClusterConfig) -> Clustering:
    return cluster_clips(library, ["c0", "c1"], tiny, table=table)


@pytest.fixture(scope="module")
def quick(tiny: ClusterConfig) -> ClusterConfig:
    """For tests that are not about the audit: next to none of it."""
    return replace(tiny, max_k=2, audit_seeds=2)


def test_stands_and_walks_are_told_apart(result: Clustering) -> None:
    labels = result.labels
    assert adjusted_rand_score(labels["family"], labels["cluster"]) == 1.0
    assert result.summary["audit"]["family_ari"]["value"] == 1.0
    assert set(labels.loc[labels["family"] == "stand", "cluster"]) == {"c0"}  # slowest first, held-out ones too


def test_summary_counts_every_clip(result: Clustering, library: list[Clip]) -> None:
    rows = result.summary["clusters"]
    assert sum(row["clips"] + row["held_out_clips"] for row in rows.values()) == len(library) == len(result.labels)
    assert [row["label"] for row in rows.values()] == ["arms", "travelling"]
    assert result.summary["clips"] == {"train": 14, "held_out": 2, "with_captions": 16, "texts": {"file": 16},
                                       "windows": 16, "windows_with_captions": 16}  # fmt: skip
    assert result.elbow["k"].tolist() == list(range(1, 7)) and len(result.curve) == 25


def test_held_out_clips_change_nothing(library: list[Clip], table: TokenTable, quick: ClusterConfig) -> None:
    """Labels of the training clips are the same whether the held-out ones are there or not."""
    short = replace(quick, epochs=3)
    training = [clip for clip in library if clip.split == "train"]
    both, alone = (cluster_clips(clips, ["a", "b"], short, table=table).labels for clips in (library, training))
    kept = both[both["split"] == "train"].reset_index(drop=True)
    assert kept["cluster"].tolist() == alone["cluster"].tolist()
    assert kept["x"].to_numpy() == pytest.approx(alone["x"].to_numpy(), abs=1e-5)


def test_where_texts_and_families_come_from_the_same_names_there_is_no_agreement_and_no_keyword(
    library: list[Clip], table: TokenTable, quick: ClusterConfig
) -> None:
    """Families read from names agree with clusters of texts made from the same names: that would prove nothing."""
    named = [replace(clip, captions=(caption_from_name(clip.name),), caption_source="name") for clip in library]
    summary = cluster_clips(named, ["c0", "c1"], replace(quick, epochs=1), table=table).summary
    assert summary["audit"]["family_ari"] is None
    assert [row["keywords"] for row in summary["clusters"].values()] == ["", ""]
    assert summary["clips"]["texts"] == {"name": len(library)}


def test_too_few_clips_are_refused_before_any_work(library: list[Clip], tiny: ClusterConfig) -> None:
    with pytest.raises(BadInput, match="at least 3 x 2 training clips for 3 clusters, came 5 training clips"):
        cluster_clips(library[:5], ["a", "b", "c"], tiny)


def test_random_clusters_have_the_same_form_and_say_so(
    result: Clustering, library: list[Clip], table: TokenTable, quick: ClusterConfig
) -> None:
    drawn = cluster_clips(library, ["c0", "c1"], replace(quick, epochs=2, method="random"), table=table)
    assert drawn.summary["method"] == drawn.summary["audit"]["method"] == "random"
    assert set(drawn.summary) == set(result.summary) and set(drawn.summary["audit"]) == set(result.summary["audit"])
    assert drawn.labels.dtypes.to_dict() == result.labels.dtypes.to_dict()
    for _, part in drawn.labels.groupby("split"):
        sizes = part["cluster"].value_counts()
        assert len(sizes) == 2 and sizes.max() - sizes.min() <= 1
    assert [row["label"] for row in drawn.summary["clusters"].values()] == ["random", "random"]
    assert drawn.summary["audit"]["family_ari"]["value"] < 0.5


def test_every_figure_of_the_audit_has_its_number_and_interval(result: Clustering) -> None:
    told = result.summary["audit"]
    for entry in (told["kinematic"]["ari"], told["kinematic"]["ami"], told["silhouette"], told["motion_only"]["ari"]):
        assert entry["n"] == 14 and entry["ci95"][0] <= entry["ci95"][1]
    assert told["stability"]["retrained"]["n"] == 1  # one pair: this training and one more
    found = result.summary["retrieval"]["text_to_motion"]
    assert found["R@1"]["n"] == 2 and found["answers"] == 2 and result.summary["retrieval"]["few"]
    assert result.elbow["retrained"].notna().sum() == 5


def test_without_any_caption_there_is_nothing_to_retrieve_and_no_text_to_leave_out(
    library: list[Clip], quick: ClusterConfig
) -> None:
    bare = [replace(clip, captions=(), caption_source="") for clip in library]
    summary = cluster_clips(bare, ["c0", "c1"], replace(quick, epochs=2)).summary
    assert summary["retrieval"] is None and summary["audit"]["motion_only"] is None
    assert summary["clips"]["texts"] == {"none": 16} and summary["clips"]["windows_with_captions"] == 0


def test_a_large_library_is_passed_fewer_times(tiny: ClusterConfig) -> None:
    assert planned_epochs(49, ClusterConfig()) == ClusterConfig().epochs
    assert planned_epochs(8179, ClusterConfig(max_steps=2000)) == 2000 // 256
    assert planned_epochs(8179, ClusterConfig(max_steps=1)) == 1
