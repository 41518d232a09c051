"""A workspace with a round of measured rollouts, for the stages ingest and gate."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee.measured.rollout import write_rollout
from tasks import gate as gate_task
from tasks import ingest
from tests.measured.simulated import g1_rollout

Setup = Callable[..., Path]


def two_clusters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Setup:
    """A workspace with two clusters of one rollout each, of which the second may be bad."""
    monkeypatch.chdir(tmp_path)
    for module in (ingest, gate_task):
        monkeypatch.setattr(module, "log_run", lambda *_, **__: None)

    def make(mode: str = "ask", bad: tuple[str, ...] = (), seed: int = 0) -> Path:
        (tmp_path / "params.yaml").write_text(f"ingest: {{}}\ngate: {{mode: {mode}}}\n")
        for number, cluster in enumerate(("c0", "c1")):
            rollout = g1_rollout(seed + number, 0.1, seconds=2.0)
            rollout = replace(rollout, meta=rollout.meta | {"cluster": cluster})
            if cluster in bad:
                rollout = replace(rollout, joint_pos=np.full_like(rollout.joint_pos, np.nan))
            write_rollout(Path(f"data/rollouts/r1/{cluster}/rollouts/{rollout.rollout_id}.parquet"), rollout)
        return tmp_path

    return make
