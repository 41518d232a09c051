"""README's figures are those of docs/figures.json, and a finished demo gives them."""

import json

import pytest

from benchmarks import readme_figures as figures
from bumblebee.errors import BadInput


def test_the_block_of_readme_is_what_the_file_gives():
    page = figures.README.read_text()
    assert figures.with_block(page, figures.block(json.loads(figures.FILE.read_text()))) == page, "make figures"


def test_each_difference_that_readme_shows_is_in_the_file():
    differences = json.loads(figures.FILE.read_text())["differences"]
    assert all(sum(line.startswith(shown) for line in differences) == 1 for shown in figures.SHOWN)


def test_the_block_alone_is_replaced():
    page = f"before\n{figures.BEGIN}old 1\n{figures.END}after\n"
    assert figures.with_block(page, "new 2\n") == f"before\n{figures.BEGIN}new 2\n{figures.END}after\n"


def test_a_page_without_the_marks_is_refused():
    with pytest.raises(BadInput, match="marks"):
        figures.with_block("a page\n", "new\n")


def test_a_workspace_without_a_finished_demo_is_refused(tmp_path):
    with pytest.raises(BadInput, match="make demo"):
        figures.measured(tmp_path, None)


def test_the_commit_is_the_one_that_the_report_names():
    assert figures.code_of("<p>2026-11-27 07:29 UTC · code 2add48cbae0f · evaluation contract 1</p>") == "2add48cbae0f"
    assert figures.code_of("<p>nothing</p>") == "unknown"
