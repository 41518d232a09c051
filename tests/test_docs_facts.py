"""What pages say of the code's settings and counts is so."""

import re
from pathlib import Path

from bumblebee.sim.effects import CATALOGUE
from tasks.policy_filter import PolicyFilter

DOCS = Path(__file__).parent.parent / "docs"


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
    assert "A generalist of the experts" in (DOCS / "results.md").read_text()
