"""The report's stage: the seal is the stand-in's truth and no other robot's."""

from pathlib import Path

import pytest

from tasks import report


@pytest.mark.parametrize(("rollouts", "expected"), [("{}", {"effects": []}), ("{source: mine}", None)])
def test_the_seal_is_not_taken_for_the_truth_about_a_real_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rollouts: str, expected: dict | None
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("params.yaml").write_text(f"rollouts: {rollouts}\n")
    report.SEALED.parent.mkdir(parents=True)
    report.SEALED.write_text('{"effects": []}')
    assert report.sealed_truth() == expected
