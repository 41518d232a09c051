"""The last lines of a loop: what is champion, and what is proposed."""

import json
from pathlib import Path

import pytest

from flows.demo import summarise
from tasks import paths


def test_a_version_that_is_proposed_is_told_and_others_are_only_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    models = {"base": {"champion": "1"}, "generalist": {"champion": None, "proposal": {"version": "2"}}}
    (tmp_path / paths.PUBLISHED).parent.mkdir()
    (tmp_path / paths.PUBLISHED).write_text(json.dumps({"models": models}))
    summarise(tmp_path)
    said = capsys.readouterr().out.splitlines()
    assert said[0].strip() == "models:/base@champion  version 1"
    assert said[1].strip() == (
        "models:/generalist@champion  version none yet; 2 is proposed: bumblebee gate show generalist"
    )
