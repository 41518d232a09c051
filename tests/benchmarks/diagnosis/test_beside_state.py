"""Two states of the code beside each other: each runs from its own checkout, a killed run goes on, the table counts."""

import argparse
import json
from pathlib import Path

import pytest

from benchmarks.diagnosis import beside_state
from benchmarks.diagnosis.beside_state import cases, diagnosed, main, run, table

CLI = """
import json, sys
from pathlib import Path
if "lost" in sys.argv[2]: sys.exit(2)
out = Path(sys.argv[sys.argv.index("--out") + 1]); out.mkdir(exist_ok=True)
(out / "diagnosis.json").write_text(json.dumps({"effects": [], "state": Path(__file__).parent.parent.name}))
"""


@pytest.fixture
def trees(tmp_path: Path) -> dict[str, Path]:
    for state in beside_state.STATES:
        (tmp_path / state / "bumblebee").mkdir(parents=True)
        (tmp_path / state / "bumblebee/__init__.py").touch()
        (tmp_path / state / "bumblebee/__main__.py").write_text(CLI)
    return {state: tmp_path / state for state in beside_state.STATES}


def test_each_state_is_that_of_its_checkout_and_one_that_breaks_is_a_result(trees, tmp_path):
    for state, tree in trees.items():
        document, seconds = diagnosed(tree, tmp_path / "case", tmp_path / f"case-{state}")
        assert document["state"] == state and seconds > 0
    document, seconds = diagnosed(trees["now"], tmp_path / "lost", tmp_path / "lost-now")
    assert document["broke"] and seconds != seconds


def row(number: int, top: tuple[bool, bool], seconds: tuple[float, float], group: str = "single") -> dict:
    def one(at: int) -> dict:
        covered = [{"covered": top[at]}] if group == "single" else []
        return {"top": top[at], "spurious": 1 - top[at], "sizes": covered, "error": 1.0, "seconds": seconds[at],
                "outside": {"flagged": True}}  # fmt: skip

    return {"case": number, "seed": 1, "robot": "arm", "group": group, "before": one(0), "now": one(1)}


def test_the_table_counts_names_intervals_and_ratios():
    rows = [
        row(0, (True, True), (10.0, 5.0)),
        row(1, (False, True), (10.0, 20.0)),
        row(2, (False, False), (1, 1), "outside"),
    ]
    text = table(rows)
    assert "| arm, single | 2 | 1 of 2 [0.09, 0.91] | 2 of 2 [0.34, 1.00] | 1 | 0 | " in text
    assert "| 1.00 [1.00, 1.00] | 1.00 [0.50, 2.00] |" in text
    assert "| arm, outside | 1 | 1 of 1" in text
    assert "before 1 of 2" in text and "now 2 of 2" in text


def test_a_run_goes_on_where_it_ended(trees, tmp_path, monkeypatch):
    asked: list[int] = []

    def compare(case, *_):
        asked.append(case.number)
        named = {"named": [], "seconds": 1.0}
        return {"seed": 5, "case": case.number, "before": named, "now": named}

    monkeypatch.setattr(beside_state, "compare", compare)
    first = [case.number for case in list(cases(5, ["arm"], ["kp"]))[:3]]
    options = argparse.Namespace(
        out=tmp_path / "out", other=trees["before"], seed=5, robot=["arm"], cases=2, without=["kp"]
    )
    run(options)
    options.cases = 3
    run(options)
    assert asked == first
    assert len([json.loads(line) for line in (tmp_path / "out/results.jsonl").read_text().splitlines()]) == 3


def test_another_folder_than_a_checkout_is_refused(tmp_path, capsys):
    assert main([str(tmp_path / "out"), "--other", str(tmp_path)]) == 2
    assert "a checkout of another state" in capsys.readouterr().err
