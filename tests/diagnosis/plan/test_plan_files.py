"""The folder that is written, the page, and what is refused in one line."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from bumblebee.cli import run
from bumblebee.diagnosis.plan import write_plan
from bumblebee.errors import BadInput
from tests.diagnosis.arm import XML
from tests.diagnosis.plan.made import planned, planned_with


def test_a_plan_is_written_whole_and_reads_back(tmp_path: Path) -> None:
    plan, out = planned(damping=True), tmp_path / "plan"
    told = write_plan(plan, out)
    assert told == json.loads((out / "plan.json").read_text())
    assert sorted(p.name for p in out.iterdir()) == ["plan.json", "runs", "sheet.html"]
    for k, motion in enumerate(plan.motions):
        table = pd.read_csv(out / "runs" / f"{k + 1:02d}.csv")
        assert list(table.columns) == ["time", "j1", "j2", "j3"]
        np.testing.assert_allclose(table[["j1", "j2", "j3"]], motion.targets, atol=1e-8)
        np.testing.assert_allclose(np.diff(table["time"]), 0.02, atol=1e-9)
        again = pq.read_table(out / "runs" / f"{k + 1:02d}.parquet")
        np.testing.assert_array_equal(again.to_pandas().to_numpy(), table.to_numpy())
        assert json.loads(again.schema.metadata[b"bumblebee.plan"])["rate"] == 50.0


def test_the_sheet_has_a_section_a_run_and_loads_nothing(tmp_path: Path) -> None:
    plan = planned(damping=True)
    write_plan(plan, tmp_path / "plan")
    page = (tmp_path / "plan" / "sheet.html").read_text()
    assert page.count("<section>") == len(plan.motions)
    assert "://" not in page and "<script" not in page and "src=" not in page
    assert "kd x 0.2" in page


def test_an_earlier_plan_is_replaced_when_told_and_nothing_else_ever(tmp_path: Path) -> None:
    plan, out = planned(damping=True), tmp_path / "plan"
    write_plan(plan, out)
    with pytest.raises(BadInput, match="--overwrite"):
        write_plan(plan, out)
    write_plan(plan, out, overwrite=True)
    (out / "runs" / "mine.txt").write_text("mine")
    with pytest.raises(BadInput, match=r"mine\.txt"):
        write_plan(plan, out, overwrite=True)
    assert (out / "runs" / "mine.txt").read_text() == "mine"


def test_a_plan_that_tells_no_open_pair_apart_is_one_line_and_no_folder(tmp_path: Path) -> None:
    """Friction passes for kd at one kd; with the damping that the line names the plan tells them apart."""
    with pytest.raises(BadInput, match="pairs told apart 0 of 1 now, 0 with all runs") as refused:
        write_plan(planned(), tmp_path / "plan")
    assert not (tmp_path / "plan").exists()
    (damping,) = re.findall(r"`--damping ([\d.]+)`", str(refused.value))
    write_plan(planned_with(damping=(float(damping),)), tmp_path / "plan")


@pytest.fixture
def arm(tmp_path: Path) -> str:
    (tmp_path / "arm.xml").write_text(XML)
    return str(tmp_path / "arm.xml")


def test_the_command_writes_a_plan(arm: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "plan"
    options = ["--speed", "4", "--travel", "1", "--travel", "j3=0.5", "--pool", "5", "--runs", "1", "--seconds", "4.5"]
    assert run(["plan", arm, "--out", str(out), *options]) == 0
    assert "1 runs of 4.5 s" in capsys.readouterr().out
    limits = json.loads((out / "plan.json").read_text())["limits"]["joints"]
    assert limits["j3"]["high"] == 0.5 and limits["j1"]["high"] == 1.0


BAD = {
    "no travel": (["--speed", "4"], "--travel"),
    "no speed": (["--travel", "1"], "--speed"),
    "no such joint": (["--travel", "1", "--speed", "elbow=2", "--speed", "4"], "'elbow'"),
    "no number": (["--travel", "1", "--speed", "fast"], "VALUE"),
    "no such keyframe": (["--travel", "1", "--speed", "4", "--start", "home"], "keyframe"),
    "too short": (["--travel", "1", "--speed", "4", "--seconds", "2"], "--seconds"),
    "no gain": (["--travel", "1", "--speed", "4", "--gains", "0"], "--gains"),
    "negative": (["--travel=-1", "--speed", "4"], "positive"),
}


@pytest.mark.parametrize(("options", "word"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_one_line_and_nothing_is_written(arm: str, tmp_path: Path, options: list[str], word: str) -> None:
    out = tmp_path / "plan"
    with pytest.raises(BadInput) as caught:
        run(["plan", arm, "--out", str(out), *options])
    assert word in str(caught.value) and "\n" not in str(caught.value)
    assert not out.exists()


def test_a_dataset_needs_its_diagnosis(arm: str, tmp_path: Path) -> None:
    (tmp_path / "dataset" / "rollouts").mkdir(parents=True)
    with pytest.raises(BadInput, match="bumblebee diagnose"):
        run(["plan", arm, str(tmp_path / "dataset"), "--out", str(tmp_path / "plan")])
    with pytest.raises(BadInput, match="bumblebee diagnose"):
        options = ["--diagnosis", str(tmp_path / "found"), "--out", str(tmp_path / "plan")]
        run(["plan", arm, str(tmp_path / "dataset"), *options])


def test_a_diagnosis_of_something_else_is_refused(arm: str, tmp_path: Path) -> None:
    (tmp_path / "dataset" / "rollouts").mkdir(parents=True)
    found = tmp_path / "found"
    found.mkdir()
    (found / "effects.yaml").write_text("schema: 1\neffects: []\n")
    options = ["--diagnosis", str(found), "--out", str(tmp_path / "plan")]
    for text in ("[]", '{"schema": 1, "effects": 3}', '{"schema": 1, "effects": [{"effect": "magic", "where": []}]}'):
        (found / "diagnosis.json").write_text(text)
        with pytest.raises(BadInput, match=r"diagnosis\.json"):
            run(["plan", arm, str(tmp_path / "dataset"), *options])
    assert not (tmp_path / "plan").exists()
