"""The intake sorts a batch, touches no original, overwrites nothing, and changes nothing when it runs again."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.io.read import file_hash
from bumblebee.measured.intake import IntakeSummary, findings_table, intake, merge
from bumblebee.measured.rollout import Rollout, read_rollout, write_rollout
from bumblebee.measured.summary import summary_table
from tasks.pages.overview import write_overview
from tests.measured.simulated import arm_model, arm_rollout


def named(seed: int, name: str, **meta: object) -> Rollout:
    rollout = arm_rollout(seed, seconds=3.0)
    return replace(rollout, rollout_id=name, meta=rollout.meta | meta)


def broken(seed: int, name: str) -> Rollout:
    rollout = named(seed, name)
    place = rollout.joint_pos.copy()
    place[5, 0] = np.nan
    return replace(rollout, joint_pos=place)


@pytest.fixture
def incoming(tmp_path: Path) -> Path:
    folder = tmp_path / "in"
    for rollout in (named(0, "a"), broken(1, "b"), named(2, "c", cluster="c1", motion="<script>alert(1)</script>")):
        write_rollout(folder / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
    (folder / "rollouts" / "d.parquet").write_bytes(b"PAR1 not really")
    return folder


def run(incoming: Path, **contracts: dict) -> IntakeSummary:
    out = incoming.parent
    return intake(incoming, out / "accepted", out / "quarantine", arm_model(), contracts)


def tree(folder: Path) -> dict[str, tuple[str, int]]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): (file_hash(path), path.stat().st_mtime_ns) for path in files}


def test_good_files_are_accepted_others_set_aside_with_their_findings(incoming: Path, tmp_path: Path) -> None:
    before = tree(incoming)
    batch = run(incoming)
    assert (batch.accepted, batch.quarantined) == (["a.parquet", "c.parquet"], ["b.parquet", "d.parquet"])
    assert sorted(tree(tmp_path / "accepted")) == ["a.parquet", "c.parquet"]
    assert sorted(tree(tmp_path / "quarantine")) == [
        "b.parquet",
        "b.parquet.findings.json",
        "d.parquet",
        "d.parquet.findings.json",
    ]
    notes = json.loads((tmp_path / "quarantine" / "b.parquet.findings.json").read_text())
    (finding,) = notes["findings"]
    assert (finding["column"], finding["row"], finding["rule"]) == ("joint_pos[shoulder]", 5, "finite")
    assert tree(incoming) == before
    assert read_rollout(tmp_path / "accepted" / "a.parquet").meta == named(0, "a").meta


def test_a_second_run_changes_nothing_and_says_the_same(incoming: Path, tmp_path: Path) -> None:
    first = run(incoming)
    before = tree(tmp_path)
    second = run(incoming)
    assert tree(tmp_path) == before
    assert summary_table(first, 1) == summary_table(second, 1)


def test_a_run_that_was_cut_off_is_finished_by_the_next(incoming: Path, tmp_path: Path) -> None:
    whole = run(incoming)
    kept = tree(tmp_path)
    (tmp_path / "accepted" / "c.parquet").unlink()
    (tmp_path / "quarantine" / "b.parquet.findings.json").unlink()
    (tmp_path / "accepted" / ".half.part").write_bytes(b"PAR1")
    again = run(incoming)
    assert again.accepted == whole.accepted
    now = {name: digest for name, (digest, _) in tree(tmp_path).items() if not name.endswith(".part")}
    assert now == {name: digest for name, (digest, _) in kept.items()}


def test_other_content_under_a_name_that_is_taken_is_a_finding_and_overwrites_nothing(
    incoming: Path, tmp_path: Path
) -> None:
    run(incoming)
    before = tree(tmp_path / "accepted")
    (incoming / "rollouts" / "a.parquet").unlink()
    write_rollout(incoming / "rollouts" / "a.parquet", named(5, "a"))
    (incoming / "rollouts" / "b.parquet").unlink()
    write_rollout(incoming / "rollouts" / "b.parquet", broken(6, "b"))
    held = tree(tmp_path / "quarantine")
    batch = run(incoming)
    assert "a.parquet" in batch.quarantined
    assert "name-taken" in set(batch.findings[batch.findings.file == "a.parquet"].rule)
    assert tree(tmp_path / "accepted") == before
    now = tree(tmp_path / "quarantine")
    assert {name: now[name] for name in held} == held and len(now) == len(held) + 4


def test_the_policy_contract_of_the_file_s_cluster_is_used(incoming: Path) -> None:
    batch = run(incoming, c1={"joints": ["elbow", "shoulder", "wrist"]})
    assert batch.accepted == ["a.parquet"]
    assert "policy-joints" in set(batch.findings.rule)


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no such folder"):
        intake(tmp_path / "none", tmp_path / "a", tmp_path / "q", arm_model())


def test_the_summary_counts_by_rule_motion_and_cluster(incoming: Path) -> None:
    table = summary_table(run(incoming), 3)
    assert (table["round"], table["accepted"], table["quarantined"]) == (3, 2, 2)
    assert table["by_rule"] == {
        "finite": {"files": 1, "fatal": 1, "warning": 0},
        "readable": {"files": 1, "fatal": 1, "warning": 0},
    }
    assert table["by_cluster"]["c0"] == {"accepted": 1, "quarantined": 1}
    assert table["by_cluster"]["unknown"] == {"accepted": 0, "quarantined": 1}
    assert table["seconds"] == pytest.approx(2 * 2.98)
    assert table["joints"] == ["shoulder", "elbow", "wrist"]


def test_merged_batches_count_together(incoming: Path, tmp_path: Path) -> None:
    batch = run(incoming)
    both = merge([batch, IntakeSummary((), findings_table([]))])
    assert both.items == batch.items and both.findings.equals(batch.findings)
    assert list(findings_table([]).columns) == list(batch.findings.columns)


def test_the_overview_shows_counts_and_escapes_what_came_from_outside(incoming: Path, tmp_path: Path) -> None:
    batch = run(incoming)
    rollouts = [read_rollout(tmp_path / "accepted" / name) for name in batch.accepted]
    write_overview(tmp_path / "overview.html", summary_table(batch, 1), batch.findings, rollouts)
    page = (tmp_path / "overview.html").read_text()
    assert "<script" not in page and "&lt;script&gt;alert(1)" in page
    assert "://" not in page  # nothing is loaded from anywhere
    for text in ("shoulder", "finite", "files accepted", "data:image/svg", "wave 0"):
        assert text in page
