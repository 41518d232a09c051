"""The page says where texts came from, and leaves out an agreement that would compare names with themselves."""

from typing import Any

import pytest

from bumblebee.report.sections.clusters_section import clusters_section
from tests.report.made import TRUTH, found, index, loop_results


def words(texts: dict[str, int], agreement: float | None) -> str:
    results = loop_results([found()], [TRUTH])
    results.clusters["clips"] = {"texts": texts}
    results.clusters["audit"]["family_ari"] = None if agreement is None else index(agreement)
    return " ".join(block.text for block in clusters_section(results).blocks)


@pytest.mark.parametrize(
    ("texts", "said"),
    [({"file": 3}, "3 clips: written by you beside"), ({"csv": 1}, "1 clip: written by you in a table"),
     ({"humanml3d": 2}, "2 clips: from HumanML3D"), ({"made": 1}, "1 clip: the embedded library's own"),
     ({"name": 2, "none": 1}, "2 clips: a template filled with the file's name; 1 clip: none")],
)  # fmt: skip
def test_each_source_of_texts_is_named(texts: dict[str, Any], said: str) -> None:
    assert said in words(texts, None) and "never from names or templates" in words(texts, None)


def test_why_there_is_no_agreement_is_said_only_where_names_are_to_blame() -> None:
    assert "would compare the names with themselves" in words({"name": 3}, None)
    assert "names with themselves" not in words({"file": 3}, None) + words({"file": 3}, 0.5)
    assert "left out of it" in words({"name": 1, "file": 2}, 0.5)
    assert "written together" in words({"made": 3}, 0.5)


def test_a_cluster_without_keywords_shows_a_dash() -> None:
    results = loop_results([found()], [TRUTH])
    results.clusters["clusters"]["c0"]["keywords"] = ""
    (table,) = [block for block in clusters_section(results).blocks if block.kind == "table"]
    assert table.rows[0][-1] == "–"
