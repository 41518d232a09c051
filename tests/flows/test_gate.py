"""`flows.gate` answers in a workspace only what was seen there."""

import json
from pathlib import Path

import pytest

from bumblebee.measured import gate
from flows import gate as gate_flow


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace with a round that waits for an answer."""
    monkeypatch.setattr(gate_flow.workspaces, "named", lambda name: tmp_path)
    monkeypatch.setattr(gate_flow.servers, "running", lambda folder: None)
    summary = tmp_path / "data/measured/r1/summary.json"
    summary.parent.mkdir(parents=True)
    summary.write_text(json.dumps({"accepted": 3, "quarantined": 1, "seconds": 4.0, "by_rule": {}}))
    return tmp_path


def test_an_answer_names_what_it_is_about_and_is_refused_for_anything_else(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    summary, approval = folder / "data/measured/r1/summary.json", folder / "data/approvals/round-1.json"
    seen = gate.seen_of(summary)["sha256"]
    answer = ["approve", "--round", "1", "--by", "Ann"]
    assert gate_flow.main([*answer, "--seen", "f" * 12]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and seen[:12] in line
    assert gate.verdict(approval, summary) == "pending"
    assert gate_flow.main([*answer, "--seen", seen[:12]]) == 0
    assert gate.verdict(approval, summary) == "approved"
    summary.write_text(summary.read_text().replace("3", "4"))
    assert gate_flow.main([*answer, "--seen", seen[:12]]) == 2
    assert gate.verdict(approval, summary) == "pending"
    capsys.readouterr()
    assert gate_flow.main(answer) == 0
    assert "(4 files accepted, 1 set aside)" in capsys.readouterr().out
