"""What `make demo` says at its end."""

import json
from pathlib import Path

import pytest

from flows.demo import summarise
from tasks import paths


def test_every_model_is_named_with_its_champion_and_what_is_proposed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    models = {"base": {"champion": "3"}, "generalist": {"champion": None, "proposal": {"version": "2"}}}
    (tmp_path / paths.PUBLISHED).parent.mkdir(parents=True)
    (tmp_path / paths.PUBLISHED).write_text(json.dumps({"models": models}))
    summarise(tmp_path)
    said = capsys.readouterr().out.splitlines()
    assert said[0].strip() == "models:/base@champion  version 3"
    assert "none yet; 2 is proposed: bumblebee gate show generalist" in said[1]
