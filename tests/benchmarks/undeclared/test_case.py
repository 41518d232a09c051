"""A case is scored whatever the diagnosis does."""

import pytest

from benchmarks.undeclared import case
from benchmarks.undeclared.lottery import Suite


def test_a_diagnosis_that_breaks_counts_as_one_that_names_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(session: object) -> None:
        raise ValueError("no such luck")

    monkeypatch.setattr(case, "diagnose", broken)
    chosen = next(c for c in Suite(1).cases() if c.robot == "arm" and c.group == "single" and not c.rivals)
    line = case.run_case(chosen, 1)
    assert "failed" not in line and line["broke"] == "ValueError: no such luck"
    assert line["ours"]["named"] == [] and not any(line["ours"]["found"]) and not line["ours"]["top"]
    assert line["errors"]["ours"] == line["errors"]["before"]
