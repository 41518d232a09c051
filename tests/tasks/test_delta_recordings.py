"""Which rollouts a cluster's delta action is trained on and judged by."""

from dataclasses import replace
from pathlib import Path

import pytest

from bumblebee.measured.rollout import write_rollout
from bumblebee.robot.model import write_xml
from tasks import delta
from tests.measured.simulated import g1_rollout

CLUSTERS = {"a": "c0", "b": "c1", "c": None, "d": "", "e": "c0", "f": None}


@pytest.fixture
def round_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A round's measured rollouts, all clusters together, some of no cluster; the last two are held out."""
    monkeypatch.chdir(tmp_path)
    folder = Path("data/measured/r1")
    one = replace(g1_rollout(0, 0.1, seconds=0.5), meta={"robot": "g1_23dof"})
    for name, cluster in CLUSTERS.items():
        write_rollout(
            folder / f"rollouts/{name}.parquet",
            replace(one, rollout_id=name, meta=one.meta | ({} if cluster is None else {"cluster": cluster})),
        )
    write_xml(folder / "model.xml")
    monkeypatch.setattr(delta, "split", lambda number: (set("abcd"), set("ef")))


def test_a_rollout_is_its_own_clusters_and_without_a_name_nobodys(
    round_one: None, capsys: pytest.CaptureFixture[str]
) -> None:
    train, held_out = delta.recordings(1, "c0")
    assert train.ids == ("a",) and held_out.ids == ("e",)
    assert "3 of 6 rollouts name no cluster" in capsys.readouterr().out
    train, held_out = delta.recordings(1, "c1")
    assert train.ids == ("b",) and held_out is None
    assert delta.recordings(1, "c2") == (None, None)
