"""The untrained policy: same shape and contract, none of the trained weights."""

import json
from pathlib import Path

import numpy as np

from bumblebee.evaluation.untrained import export_untrained
from bumblebee.learning.export import write_export
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.tracking.sampling.library import AHEAD
from tests.policy.conftest import linear_onnx


def test_weights_are_drawn_anew_and_the_rest_stays(tmp_path: Path) -> None:
    trained, fresh = tmp_path / "trained", tmp_path / "fresh"
    trained.mkdir()
    write_export(trained, linear_onnx(0.5), AHEAD)
    export_untrained(trained, fresh)
    first, second = ExportedPolicy.load(trained), ExportedPolicy.load(fresh)
    contracts = [json.loads((folder / "contract.json").read_text()) for folder in (trained, fresh)]
    assert {k for k in contracts[0] if contracts[0][k] != contracts[1][k]} == {"onnx_sha256"}
    obs = np.random.default_rng(0).standard_normal((4, first.session.get_inputs()[0].shape[1]))
    actions = [policy.act(obs) for policy in (first, second)]
    assert abs(np.corrcoef(actions[0].ravel(), actions[1].ravel())[0, 1]) < 0.5
    assert np.abs(actions[1]).max() < 5.0
