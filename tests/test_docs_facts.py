"""Pages say true things of the code's settings and counts."""

import re
from pathlib import Path

from bumblebee.sim.effects import CATALOGUE
from tasks.policies.policy_filter import PolicyFilter

HOME = Path(__file__).parent.parent
DOCS = HOME / "docs"


def test_the_glossary_counts_the_effects_that_have_a_name():
    named = set(CATALOGUE) - {"discovered"}  # the law of what is none of them
    found = re.search(
        r"^\| catalogue effect \| one of the (\d+) effects", (DOCS / "glossary.md").read_text(), re.MULTILINE
    )
    assert found and int(found[1]) == len(named)


def test_the_page_on_data_says_whether_the_policy_filter_is_on_by_default():
    assert not PolicyFilter().source
    assert "or the folder of an exported policy; nothing: off" in (DOCS / "data.md").read_text()


def test_no_page_says_of_the_student_that_it_was_not_run_on_a_gpu():
    assert "Not run on a GPU" not in (DOCS / "training.md").read_text()
    assert "one NVIDIA H200" in (DOCS / "results" / "generalist.md").read_text()


def test_every_test_that_a_promise_names_is_there():
    """Cells of docs/trust.md name files, and functions or classes in the file that was named last."""
    missing, file = [], None
    for name in re.findall(r"`((?:tests/[\w/.]+|::\w+|tests/[\w/.]+::\w+)[^`]*)`", (DOCS / "trust.md").read_text()):
        path, _, function = name.partition("::")
        file = HOME / path.split()[0] if path else file
        word = re.match(r"\w*", function).group()
        if file is None or not file.exists() or (word and f"def {word}" not in file.read_text()):
            missing.append(name)
    assert missing == []


def test_the_glossary_explains_each_word_once_in_three_columns():
    rows = [line for line in (DOCS / "glossary.md").read_text().splitlines() if re.match(r"\| (?!word|---)", line)]
    words = [row.split(" | ")[0] for row in rows]
    assert len(set(words)) == len(words)
    assert [row for row in rows if row.count("|") != 4] == []
